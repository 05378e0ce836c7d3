// The hierarchy over all charts, for traversal without a stack [Carr2006]: nodes are stored in the
// order of visits. A hit leads to the next node, a miss to the node's miss link.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/math.h"

namespace catoptric::methods::glossy_lod {

/// The grid of a chart: (2^level + 1)^2 vertices and 4^level quads, row by row.
struct Grid {
  std::uint32_t firstVertex = 0;
  std::uint32_t firstQuad = 0;
  int level = 0;
};

/// A node with its bounding box. Two nodes fill a cache line.
struct Node {
  Vec3 least{0.0f};
  std::uint32_t miss = 0;  ///< the node after this one and all below it
  Vec3 most{0.0f};
  std::uint32_t flags = 0;  ///< kHasQuad, kIsLeaf, kLowerFolds, kUpperFolds
};
static_assert(sizeof(Node) == 32);
inline constexpr std::uint32_t kHasQuad = 1;  ///< node of a chart, with a quad
inline constexpr std::uint32_t kIsLeaf = 2;
/// Where a grid is too coarse to follow its chart's border, a triangle of a quad can fold over: its
/// front then shows the surface's back.
inline constexpr std::uint32_t kLowerFolds = 4;
inline constexpr std::uint32_t kUpperFolds = 8;

/// The quad of a chart's node on its level of detail.
struct Quad {
  std::uint32_t first = 0;  ///< vertex v00
  std::uint32_t up = 0;     ///< index difference between v00 and v01
  std::uint32_t chart = 0;
  std::uint32_t place = 0;  ///< v00 in the chart's grid: column | row << 12 | level << 24
};

/// Successive nodes.
struct NodeRange {
  std::uint32_t first = ~0u;
  std::uint32_t end = 0;
  void extend(const NodeRange& other) {
    first = std::min(first, other.first);
    end = std::max(end, other.end);
  }
};

class Tree {
 public:
  /// Each node within a chart has 4 children; nodes above charts are split in two by the area of
  /// their boxes. If `from` is set, the children nearest to it come first.
  /// `normals`: the surface's normal at each quad of the finest level.
  void build(std::span<const Grid> grids, std::span<const Vec4> vertices,
             std::span<const Vec3> normals, const std::optional<Vec3>& from);
  /// Updates the boxes after vertices of these charts have moved. The nodes stay the same.
  void refit(std::span<const Vec4> vertices, std::span<const std::uint32_t> charts);

  const std::vector<Node>& nodes() const { return nodes_; }
  const std::vector<Quad>& quads() const { return quads_; }
  NodeRange nodesOf(std::uint32_t chart) const {
    return {roots_[chart], nodes_[roots_[chart]].miss};
  }

 private:
  void addSplit(std::span<std::uint32_t> charts, int depth);
  /// Distance from from_ to the centre of the charts' bounding box.
  float metresTo(std::span<const std::uint32_t> charts) const;
  /// Sorts charts along the best axis. Returns how many of them go into the first half.
  std::size_t sortForSplit(std::span<std::uint32_t> charts) const;
  /// Returns the number of the chart's top node. Adds the surface's normals to `normal`.
  std::uint32_t addChart(std::uint32_t chart, int level, std::uint32_t column, std::uint32_t row,
                         Vec3& normal);
  std::uint32_t addNode(std::uint32_t flags, const Quad& quad);
  /// Returns kLowerFolds and kUpperFolds for triangles of the quad that face away from `normal`,
  /// the surface's normal.
  std::uint32_t foldsOf(const Quad& quad, const Vec3& normal) const;
  /// Sets the box of a node from its children, or from a leaf's corners.
  void refitNode(std::uint32_t number, std::span<const Vec4> vertices);

  // Used while the tree is built
  std::span<const Grid> grids_;
  std::span<const Vec4> vertices_;
  std::optional<Vec3> from_;
  std::span<const Vec3> normals_;
  std::vector<Box3> boxes_;  ///< boxes of the charts

  std::vector<Node> nodes_;
  std::vector<Quad> quads_;
  std::vector<std::uint32_t> roots_;   ///< top node of each chart
  std::vector<std::uint32_t> splits_;  ///< nodes above charts, parents first
};

}  // namespace catoptric::methods::glossy_lod
