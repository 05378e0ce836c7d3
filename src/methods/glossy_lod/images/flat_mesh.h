// A chart as a mesh of its own, that may be cut further, on its way onto the unit square.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "methods/glossy_lod/images/outline.h"

namespace catoptric::methods::glossy_lod {

/// A place on a triangle of the object: b1, b2 weigh its second and third corner.
struct TrianglePlace {
  std::uint32_t triangle = 0;
  float b1 = 0.0f;
  float b2 = 0.0f;
};

/// Quads along an edge of the largest geometry image: 2 to this.
inline constexpr int kMostLevels = 10;

/// An edge of a chart's border; a corner of the square may lie at its start.
struct BorderEdge {
  int from = 0;         ///< vertex of the flat mesh
  std::size_t use = 0;  ///< of Chart::border
  double metres = 0.0;
};

/// A run of the border along one arc and one side of the square.
struct BorderPiece {
  std::size_t use = 0;
  std::size_t firstEdge = 0;  ///< of the border
  std::size_t edges = 0;
  int steps = 1;      ///< of the square's lattice
  int firstStep = 0;  ///< of those along the whole arc
};

class FlatMesh {
 public:
  FlatMesh(const MeshView& mesh, const Topology& topology, const Outlines& outlines,
           std::size_t chart);

  /// Finds the corners of the square where the border turns most, and the pieces in between.
  void placeCorners();
  /// The same, at these welded vertices, in any order.
  void placeCorners(const std::array<std::uint32_t, 4>& vertices);
  /// The welded vertices that placeCorners() has found, fewer where it has cut edges.
  std::vector<std::uint32_t> cornerVertices() const;
  /// Gives each side 2^level steps, as many to each piece as its length asks for; false where there
  /// are more pieces than steps, `wanted` of each at the least.
  bool giveSteps(int level, int wanted);
  /// Mean-value coordinates [Floater2003] inside, the border by its steps; false where it folds.
  bool flatten();
  /// Places at the points (i + shift, j + shift) / n of the square, i and j below `count`, row by
  /// row; empty where some are not covered.
  std::vector<TrianglePlace> placesAt(int n, double shift, int first, int count) const;

  /// On one of the square's halves, (v00, v10, v01) or else (v11, v01, v10): the place with these
  /// weights of its second and third corner. For charts of one or two triangles.
  TrianglePlace onHalf(bool lower, double b1, double b2) const;

  /// In order around the square, from its corner v00; each side has at least one.
  const std::vector<BorderPiece>& pieces() const { return pieces_; }
  int level() const { return level_; }
  std::size_t triangles() const { return triangles_.size(); }
  /// Root mean square of the map's singular values over the root of their mean product: 1 where
  /// nothing is stretched [Sander2001].
  double stretch() const;

 private:
  struct Triangle {
    std::array<int, 3> v{};
    std::uint32_t source = 0;
    std::array<glm::dvec2, 3> at{};  ///< of each corner: weights of the source's corners 1 and 2
  };

  int addVertex(const glm::dvec3& position);
  /// Puts a vertex on an edge of a triangle, if it has it: a triangle is added.
  bool splitTriangle(std::size_t t, int a, int b, double share, int middle);
  void splitEdge(int a, int b, double share, int middle);
  void cutAt(double metres);
  void makePieces();
  void splitChords();
  void placeBorder();
  bool solve();

  std::vector<glm::dvec3> positions_;
  std::vector<std::uint32_t> welded_;  ///< of the mesh's own vertices, which come first
  std::vector<glm::dvec2> uv_;
  std::vector<Triangle> triangles_;
  std::vector<BorderEdge> border_;
  std::vector<std::size_t> corners_;  ///< four edges of the border, in order
  std::vector<BorderPiece> pieces_;
  std::array<std::size_t, 5> firstPiece_{};  ///< of each side
  int level_ = 0;
};

/// How an integer number of steps is given to parts by their lengths, each at least as many as it
/// needs; the sum of those must not be greater.
std::vector<int> shareSteps(int steps, const std::vector<double>& lengths,
                            const std::vector<int>& least);

}  // namespace catoptric::methods::glossy_lod
