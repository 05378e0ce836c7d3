// The hierarchy over all charts, threaded for traversal without a stack [Carr2006]: nodes in the
// order in which they are visited, each with the one to go to when it is missed. The one to go to
// when it is hit is the next.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/math.h"

namespace catoptric::methods::glossy_lod {

/// Vertices of a chart: (2^level + 1)^2, row by row.
struct Grid {
  std::uint32_t firstVertex = 0;
  int level = 0;
};

/// Two of them fill a cache line.
struct Node {
  Vec3 least{0.0f};
  std::uint32_t miss = 0;  ///< the node after this one and all below it
  Vec3 most{0.0f};
  std::uint32_t flags = 0;  ///< kHasQuad, kIsLeaf
};
static_assert(sizeof(Node) == 32);
inline constexpr std::uint32_t kHasQuad = 1;  ///< of a chart: its corners make a quad
inline constexpr std::uint32_t kIsLeaf = 2;

/// The quad of a chart's node on its level.
struct Quad {
  std::uint32_t first = 0;  ///< vertex v00
  std::uint32_t up = 0;     ///< vertices from v00 to v01
  std::uint32_t chart = 0;
  std::uint32_t place = 0;  ///< column, row << 12 of v00 in the chart's grid; level << 24
};

class Tree {
 public:
  /// 4-to-1 within charts, in two by the areas of boxes above them. With `from` of all children of
  /// a node the nearest to it come first.
  void build(std::span<const Grid> grids, std::span<const Vec4> vertices,
             const std::optional<Vec3>& from);
  /// The same nodes about moved vertices of these charts.
  void refit(std::span<const Vec4> vertices, std::span<const std::uint32_t> charts);

  const std::vector<Node>& nodes() const { return nodes_; }
  const std::vector<Quad>& quads() const { return quads_; }

 private:
  void addSplit(std::span<std::uint32_t> charts, int depth);
  /// From from_ to the middle of the box about charts.
  float metresTo(std::span<const std::uint32_t> charts) const;
  /// Sorts charts along the best axis; how many of them go into the first half.
  std::size_t sortForSplit(std::span<std::uint32_t> charts) const;
  /// Returns the number of the chart's uppermost node.
  std::uint32_t addChart(std::uint32_t chart, int level, std::uint32_t column, std::uint32_t row);
  std::uint32_t addNode(std::uint32_t flags, const Quad& quad);
  /// The box about a node's children, or a leaf's corners.
  void refitNode(std::uint32_t number, std::span<const Vec4> vertices);

  // While it is built
  std::span<const Grid> grids_;
  std::span<const Vec4> vertices_;
  std::optional<Vec3> from_;
  std::vector<Box3> boxes_;  ///< of charts

  std::vector<Node> nodes_;
  std::vector<Quad> quads_;
  std::vector<std::uint32_t> roots_;   ///< uppermost node of each chart
  std::vector<std::uint32_t> splits_;  ///< nodes above charts, parents first
};

}  // namespace catoptric::methods::glossy_lod
