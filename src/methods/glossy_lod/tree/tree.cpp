#include "methods/glossy_lod/tree/tree.h"

#include <algorithm>
#include <numeric>

namespace catoptric::methods::glossy_lod {
namespace {

constexpr std::uint32_t kNoParent = ~0u;

Box3 boxOf(const Grid& grid, std::span<const Vec4> vertices) {
  const std::size_t row = (std::size_t{1} << grid.level) + 1;
  Box3 box;
  for (std::size_t v = 0; v < row * row; ++v) box.extend(Vec3(vertices[grid.firstVertex + v]));
  return box;
}

}  // namespace

void Tree::build(std::span<const Grid> grids, std::span<const Vec4> vertices) {
  grids_ = grids;
  nodes_.clear();
  quads_.clear();
  parents_.clear();
  centres_.clear();
  std::size_t count = 2 * grids.size();
  for (const Grid& grid : grids) {
    centres_.push_back(boxOf(grid, vertices).centre());
    count += ((std::size_t{4} << (2 * grid.level)) - 1) / 3;
  }
  nodes_.reserve(count);
  quads_.reserve(count);
  parents_.reserve(count);
  std::vector<std::uint32_t> charts(grids.size());
  std::iota(charts.begin(), charts.end(), 0u);
  if (!charts.empty()) addSplit(charts, kNoParent);
  centres_.clear();
  refit(vertices);
}

std::uint32_t Tree::addNode(std::uint32_t flags, const Quad& quad, std::uint32_t parent) {
  const auto number = static_cast<std::uint32_t>(nodes_.size());
  nodes_.push_back({.flags = flags});
  quads_.push_back(quad);
  parents_.push_back(parent);
  return number;
}

void Tree::addSplit(std::span<std::uint32_t> charts, std::uint32_t parent) {
  if (charts.size() == 1) {
    addChart(charts[0], grids_[charts[0]].level, 0, 0, parent);
    return;
  }
  const std::uint32_t number = addNode(0, {}, parent);
  Box3 centres;
  for (const std::uint32_t c : charts) centres.extend(centres_[c]);
  const Vec3 size = centres.max - centres.min;
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  const std::size_t half = charts.size() / 2;
  std::nth_element(charts.begin(), charts.begin() + static_cast<std::ptrdiff_t>(half), charts.end(),
                   [&](std::uint32_t a, std::uint32_t b) {
                     const float x = centres_[a][axis];
                     const float y = centres_[b][axis];
                     return x != y ? x < y : a < b;
                   });
  addSplit(charts.first(half), number);
  addSplit(charts.subspan(half), number);
  nodes_[number].miss = static_cast<std::uint32_t>(nodes_.size());
}

void Tree::addChart(std::uint32_t chart, int level, std::uint32_t column, std::uint32_t row,
                    std::uint32_t parent) {
  const Grid& grid = grids_[chart];
  const std::uint32_t across = (1u << grid.level) + 1;
  const Quad quad{grid.firstVertex + row * across + column, across << level, chart,
                  column | row << 12 | static_cast<std::uint32_t>(level) << 24};
  const std::uint32_t number = addNode(kHasQuad | (level == 0 ? kIsLeaf : 0), quad, parent);
  if (level > 0) {
    const std::uint32_t half = 1u << (level - 1);
    for (std::uint32_t child = 0; child < 4; ++child)
      addChart(chart, level - 1, column + (child & 1) * half, row + (child >> 1) * half, number);
  }
  nodes_[number].miss = static_cast<std::uint32_t>(nodes_.size());
}

void Tree::refit(std::span<const Vec4> vertices) {
  for (Node& node : nodes_) {
    node.least = Box3{}.min;
    node.most = Box3{}.max;
  }
  for (std::size_t i = nodes_.size(); i-- > 0;) {
    Node& node = nodes_[i];
    if ((node.flags & kIsLeaf) != 0) {
      const Quad& quad = quads_[i];
      for (const std::uint32_t v : {0u, 1u, quad.up, quad.up + 1}) {
        const Vec3 p(vertices[quad.first + v]);
        node.least = glm::min(node.least, p);
        node.most = glm::max(node.most, p);
      }
    }
    if (parents_[i] == kNoParent) continue;
    Node& parent = nodes_[parents_[i]];
    parent.least = glm::min(parent.least, node.least);
    parent.most = glm::max(parent.most, node.most);
  }
}

}  // namespace catoptric::methods::glossy_lod
