#include "methods/glossy_lod/tree/tree.h"

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>
#include <utility>

#include "core/parallel.h"

namespace catoptric::methods::glossy_lod {
namespace {

/// Splits below one another after which charts are halved by number. Ours: 100,000 charts take 17.
constexpr int kMostDepth = 48;

double areaOf(const Box3& box) {
  const glm::dvec3 size(box.max - box.min);
  return size.x * size.y + size.y * size.z + size.z * size.x;
}

Box3 boxOf(const Grid& grid, std::span<const Vec4> vertices) {
  const std::size_t row = (std::size_t{1} << grid.level) + 1;
  Box3 box;
  for (std::size_t v = 0; v < row * row; ++v) box.extend(Vec3(vertices[grid.firstVertex + v]));
  return box;
}

}  // namespace

void Tree::build(std::span<const Grid> grids, std::span<const Vec4> vertices,
                 std::span<const Vec3> normals, const std::optional<Vec3>& from) {
  grids_ = grids;
  vertices_ = vertices;
  normals_ = normals;
  from_ = from;
  nodes_.clear();
  quads_.clear();
  splits_.clear();
  roots_.assign(grids.size(), 0);
  boxes_.clear();
  std::size_t count = 2 * grids.size();
  for (const Grid& grid : grids) {
    boxes_.push_back(boxOf(grid, vertices));
    count += ((std::size_t{4} << (2 * grid.level)) - 1) / 3;
  }
  nodes_.reserve(count);
  quads_.reserve(count);
  std::vector<std::uint32_t> charts(grids.size());
  std::iota(charts.begin(), charts.end(), 0u);
  if (!charts.empty()) addSplit(charts, 0);
  boxes_.clear();
  std::iota(charts.begin(), charts.end(), 0u);
  refit(vertices, charts);
}

std::uint32_t Tree::addNode(std::uint32_t flags, const Quad& quad) {
  const auto number = static_cast<std::uint32_t>(nodes_.size());
  nodes_.push_back({.flags = flags});
  quads_.push_back(quad);
  return number;
}

std::uint32_t Tree::foldsOf(const Quad& quad, const Vec3& normal) const {
  const std::uint32_t right = 1u << (quad.place >> 24);
  const Vec4* const v = &vertices_[quad.first];
  const auto looksAway = [&](const Vec4& corner, const Vec4& b, const Vec4& c) {
    return glm::dot(glm::cross(Vec3(b) - Vec3(corner), Vec3(c) - Vec3(corner)), normal) < 0.0f;
  };
  return (looksAway(v[0], v[right], v[quad.up]) ? kLowerFolds : 0) |
         (looksAway(v[quad.up + right], v[quad.up], v[right]) ? kUpperFolds : 0);
}

std::size_t Tree::sortForSplit(std::span<std::uint32_t> charts) const {
  // [Wald2007] of all splits the one with the least area of boxes times charts in them
  const auto sortAlong = [&](int axis) {
    std::sort(charts.begin(), charts.end(), [&](std::uint32_t a, std::uint32_t b) {
      const float x = boxes_[a].min[axis] + boxes_[a].max[axis];
      const float y = boxes_[b].min[axis] + boxes_[b].max[axis];
      return x != y ? x < y : a < b;
    });
  };
  double least = std::numeric_limits<double>::infinity();
  std::size_t best = charts.size() / 2;
  int bestAxis = 0;
  std::vector<double> after(charts.size());
  for (int axis = 0; axis < 3; ++axis) {
    sortAlong(axis);
    Box3 box;
    for (std::size_t i = charts.size(); i-- > 1;) {
      box.extend(boxes_[charts[i]]);
      after[i] = areaOf(box) * static_cast<double>(charts.size() - i);
    }
    box = Box3{};
    for (std::size_t i = 1; i < charts.size(); ++i) {
      box.extend(boxes_[charts[i - 1]]);
      const double cost = areaOf(box) * static_cast<double>(i) + after[i];
      if (!(cost < least)) continue;
      least = cost;
      best = i;
      bestAxis = axis;
    }
  }
  if (bestAxis != 2) sortAlong(bestAxis);
  return best;
}

float Tree::metresTo(std::span<const std::uint32_t> charts) const {
  Box3 box;
  for (const std::uint32_t chart : charts) {
    box.extend(boxes_[chart].min);
    box.extend(boxes_[chart].max);
  }
  return glm::distance(*from_, 0.5f * (box.min + box.max));
}

void Tree::addSplit(std::span<std::uint32_t> charts, int depth) {
  if (charts.size() == 1) {
    Vec3 normal(0.0f);
    roots_[charts[0]] = addChart(charts[0], grids_[charts[0]].level, 0, 0, normal);
    return;
  }
  const std::uint32_t number = addNode(0, {});
  splits_.push_back(number);
  std::size_t first = sortForSplit(charts);
  if (depth > kMostDepth) first = charts.size() / 2;
  std::array<std::span<std::uint32_t>, 2> halves = {charts.first(first), charts.subspan(first)};
  if (from_ && metresTo(halves[1]) < metresTo(halves[0])) std::swap(halves[0], halves[1]);
  for (const std::span<std::uint32_t> half : halves) addSplit(half, depth + 1);
  nodes_[number].miss = static_cast<std::uint32_t>(nodes_.size());
}

std::uint32_t Tree::addChart(std::uint32_t chart, int level, std::uint32_t column,
                             std::uint32_t row, Vec3& normal) {
  const Grid& grid = grids_[chart];
  const std::uint32_t across = (1u << grid.level) + 1;
  const Quad quad{grid.firstVertex + row * across + column, across << level, chart,
                  column | row << 12 | static_cast<std::uint32_t>(level) << 24};
  const std::uint32_t number = addNode(kHasQuad | (level == 0 ? kIsLeaf : 0), quad);
  Vec3 own(0.0f);
  if (level > 0) {
    const std::uint32_t half = 1u << (level - 1);
    std::array<std::uint32_t, 4> children = {0, 1, 2, 3};
    if (from_) {
      std::array<float, 4> metres{};
      for (const std::uint32_t child : children) {
        const Vec4* const v = &vertices_[quad.first + ((child & 1) + (child >> 1) * across) * half];
        metres[child] = glm::distance(*from_, 0.5f * (Vec3(v[0]) + Vec3(v[half * (across + 1)])));
      }
      std::ranges::stable_sort(children, {}, [&](std::uint32_t child) { return metres[child]; });
    }
    for (const std::uint32_t child : children)
      addChart(chart, level - 1, column + (child & 1) * half, row + (child >> 1) * half, own);
  } else {
    own = normals_[grid.firstQuad + (row << grid.level) + column];
  }
  normal += own;
  nodes_[number].flags |= foldsOf(quad, own);
  nodes_[number].miss = static_cast<std::uint32_t>(nodes_.size());
  return number;
}

void Tree::refitNode(std::uint32_t number, std::span<const Vec4> vertices) {
  Node& node = nodes_[number];
  Box3 box;
  if ((node.flags & kIsLeaf) != 0) {
    const Quad& quad = quads_[number];
    for (const std::uint32_t v : {0u, 1u, quad.up, quad.up + 1})
      box.extend(Vec3(vertices[quad.first + v]));
  } else {
    for (std::uint32_t child = number + 1; child < node.miss; child = nodes_[child].miss) {
      box.extend(nodes_[child].least);
      box.extend(nodes_[child].most);
    }
  }
  node.least = box.min;
  node.most = box.max;
}

void Tree::refit(std::span<const Vec4> vertices, std::span<const std::uint32_t> charts) {
  // Children have higher numbers
  parallelFor(charts.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t c = begin; c < end; ++c) {
      const std::uint32_t root = roots_[charts[c]];
      for (std::uint32_t number = nodes_[root].miss; number-- > root;) refitNode(number, vertices);
    }
  });
  for (std::size_t i = splits_.size(); i-- > 0;) refitNode(splits_[i], vertices);
}

}  // namespace catoptric::methods::glossy_lod
