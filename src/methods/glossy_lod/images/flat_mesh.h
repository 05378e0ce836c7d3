// Maps a chart, as a mesh of its own whose edges can be split, onto the unit square.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "methods/glossy_lod/images/outline.h"

namespace catoptric::methods::glossy_lod {

/// A position on a triangle of the object: b1, b2 are the weights of its second and third corner.
struct TrianglePlace {
  std::uint32_t triangle = 0;
  float b1 = 0.0f;
  float b2 = 0.0f;
};

/// The largest geometry image has 2 to the power of this quads along an edge.
inline constexpr int kMostLevels = 10;

/// An edge of a chart's border. A corner of the square may lie at its start.
struct BorderEdge {
  int from = 0;         ///< vertex of the flat mesh
  std::size_t use = 0;  ///< index in Chart::border
  double metres = 0.0;
};

/// Successive border edges that belong to one arc (see Outlines) and one side of the square.
struct BorderPiece {
  std::size_t use = 0;
  std::size_t firstEdge = 0;  ///< index of a border edge
  std::size_t edges = 0;
  int steps = 1;      ///< number of lattice steps on the square
  int firstStep = 0;  ///< number of its first step within the whole arc
};

class FlatMesh {
 public:
  FlatMesh(const MeshView& mesh, const Topology& topology, const Outlines& outlines,
           std::size_t chart);

  /// Places the square's corners where the border turns most, and makes the pieces in between.
  void placeCorners();
  /// As placeCorners(), but at these welded vertices, in any order.
  void placeCorners(const std::array<std::uint32_t, 4>& vertices);
  /// The welded vertices that placeCorners() has chosen; fewer than 4 if it has split edges.
  std::vector<std::uint32_t> cornerVertices() const;
  /// Gives each side 2^level steps, which its pieces share in proportion to their lengths. Each
  /// piece gets at least `wanted` steps, or as many as it has edges if that is fewer. Returns false
  /// if a side has too many pieces for that.
  bool giveSteps(int level, int wanted);
  /// Computes mean-value coordinates [Floater2003] inside the border. False if a triangle flips.
  bool flatten();
  /// The triangle positions at the points ((i + shift) / n, (j + shift) / n) of the square, row by
  /// row. i and j run from `first` to first + count - 1. Returns an empty list if no triangle
  /// covers some point.
  std::vector<TrianglePlace> placesAt(int n, double shift, int first, int count) const;

  /// A position on one half of the square, (v00, v10, v01) if `lower`, otherwise (v11, v01, v10),
  /// with these weights of the half's second and third corner. For charts of one or two triangles.
  TrianglePlace onHalf(bool lower, double b1, double b2) const;

  /// The pieces in order around the square, from its corner v00; each side has at least one.
  const std::vector<BorderPiece>& pieces() const { return pieces_; }
  int level() const { return level_; }
  std::size_t triangles() const { return triangles_.size(); }
  /// Root mean square of the map's singular values, divided by the root of their mean product. 1:
  /// nothing is stretched [Sander2001].
  double stretch() const;

 private:
  struct Triangle {
    std::array<int, 3> v{};
    std::uint32_t source = 0;
    std::array<glm::dvec2, 3> at{};  ///< per corner: weights of the source's corners 1 and 2
  };

  int addVertex(const glm::dvec3& position);
  /// Splits triangle `t` at `middle` if it has the edge (a, b); this adds a triangle.
  bool splitTriangle(std::size_t t, int a, int b, double share, int middle);
  void splitEdge(int a, int b, double share, int middle);
  void cutAt(double metres);
  void makePieces();
  void splitChords();
  void placeBorder();
  bool solve();

  std::vector<glm::dvec3> positions_;
  std::vector<std::uint32_t> welded_;  ///< indexed by the mesh's own vertices, which come first
  std::vector<glm::dvec2> uv_;
  std::vector<Triangle> triangles_;
  std::vector<BorderEdge> border_;
  std::vector<std::size_t> corners_;  ///< indices of four border edges, in order
  std::vector<BorderPiece> pieces_;
  std::array<std::size_t, 5> firstPiece_{};  ///< first piece of each side
  int level_ = 0;
};

/// Divides an integer number of steps among parts in proportion to their lengths. Each part gets at
/// least its entry in `least`; their sum must not exceed `steps`.
std::vector<int> shareSteps(int steps, const std::vector<double>& lengths,
                            const std::vector<int>& least);

}  // namespace catoptric::methods::glossy_lod
