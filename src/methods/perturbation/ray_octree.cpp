#include "methods/perturbation/ray_octree.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <numeric>
#include <queue>
#include <utility>

namespace catoptric::methods::perturbation {
namespace {

/// Distances of doubles may be off by this part of the coordinates' size.
constexpr double kRounding = 1e-14;

}  // namespace

RayOctree::RayOctree(std::vector<SampleRay> rays, const glm::dvec3& min, const glm::dvec3& max,
                     const Settings& settings)
    : rays_(std::move(rays)), min_(min), size_(max - min), settings_(settings) {
  assert(settings_.k > 0 && settings_.maxDepth >= 0 && settings_.maxDepth < 31);
  assert(std::all_of(rays_.begin(), rays_.end(), [](const SampleRay& r) {
    return std::isfinite(glm::dot(r.origin, glm::dvec3(1.0))) &&
           std::isfinite(glm::dot(r.direction, glm::dvec3(1.0))) && r.length >= 0.0;
  }));
  all_.resize(rays_.size());
  std::iota(all_.begin(), all_.end(), 0u);
  build();
}

std::vector<std::uint32_t> RayOctree::candidateSet(const glm::dvec3& centre, double radius,
                                                   const std::vector<std::uint32_t>& from) const {
  // DEVIATION: Fig. 3 takes the largest rho.max of a set of at least k rays as bound; the k-th
  // smallest is enough. In the sphere a ray's distance differs from the one at the centre by at
  // most the radius, so the k nearest of any point there are within d_k + 2 radius at the centre.
  if (from.size() <= settings_.k) return from;
  std::vector<double> distances(from.size());
  double size = radius + glm::length(centre);
  for (std::size_t i = 0; i < from.size(); ++i) {
    distances[i] = distanceTo(rays_[from[i]], centre);
    size = std::max(size, distances[i]);
  }
  std::vector<double> sorted = distances;
  const auto kth = sorted.begin() + static_cast<std::ptrdiff_t>(settings_.k - 1);
  std::nth_element(sorted.begin(), kth, sorted.end());
  const double limit = *kth + 2.0 * radius + kRounding * size;
  std::vector<std::uint32_t> kept;
  for (std::size_t i = 0; i < from.size(); ++i) {
    if (distances[i] <= limit) kept.push_back(from[i]);
  }
  return kept;
}

void RayOctree::build() {
  // DEVIATION: the paper stops where a division fails to reduce a cell's set. Large cells keep
  // almost all rays, so that ends at the root. We divide the cell that costs look-ups most (its
  // volume times its candidates) as long as there may be more leaves.
  struct Cell {
    glm::dvec3 centre;
    glm::dvec3 half;
    int depth;
    std::vector<std::uint32_t> rays;
  };
  using Costly = std::pair<double, std::uint32_t>;
  nodes_.emplace_back();
  std::vector<Cell> cells{{min_ + 0.5 * size_, 0.5 * size_, 0, all_}};
  std::priority_queue<Costly> queue;
  const auto offer = [&](std::uint32_t node) {
    const Cell& cell = cells[node];
    if (cell.depth == settings_.maxDepth ||
        cell.rays.size() <= std::max(settings_.k, settings_.leafSize))
      return;
    queue.emplace(std::ldexp(static_cast<double>(cell.rays.size()), -3 * cell.depth), node);
  };
  offer(0);
  std::size_t leaves = 1;
  while (!queue.empty() && leaves + 7 <= settings_.maxLeaves) {
    const std::uint32_t node = queue.top().second;
    queue.pop();
    const Cell parent = std::move(cells[node]);
    cells[node].rays.clear();
    nodes_[node].child = static_cast<std::uint32_t>(nodes_.size());
    const glm::dvec3 half = 0.5 * parent.half;
    for (std::uint32_t octant = 0; octant < 8; ++octant) {
      const glm::dvec3 centre =
          parent.centre + half * glm::dvec3((octant & 1) ? 1.0 : -1.0, (octant & 2) ? 1.0 : -1.0,
                                            (octant & 4) ? 1.0 : -1.0);
      nodes_.emplace_back();
      cells.push_back(
          {centre, half, parent.depth + 1, candidateSet(centre, glm::length(half), parent.rays)});
      offer(static_cast<std::uint32_t>(cells.size() - 1));
    }
    leaves += 7;
  }
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    nodes_[i].begin = static_cast<std::uint32_t>(candidates_.size());
    candidates_.insert(candidates_.end(), cells[i].rays.begin(), cells[i].rays.end());
    nodes_[i].end = static_cast<std::uint32_t>(candidates_.size());
  }
}

std::span<const std::uint32_t> RayOctree::candidates(const glm::dvec3& point,
                                                     Cursor& cursor) const {
  const glm::dvec3 relative = (point - min_) / size_;
  const bool inside = glm::all(glm::greaterThanEqual(relative, glm::dvec3(0.0))) &&
                      glm::all(glm::lessThan(relative, glm::dvec3(1.0)));
  if (!inside) {
    ++cursor.outside;
    return all_;
  }
  const int top = settings_.maxDepth;
  std::array<std::uint32_t, 3> cell{};
  std::uint32_t different = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    cell[i] = static_cast<std::uint32_t>(std::ldexp(relative[axis], top));
    different |= cell[i] ^ cursor.cell[i];
  }
  // Up to the first common ancestor, then down.
  const int common = top - static_cast<int>(std::bit_width(different));
  int depth = cursor.depth < 0 ? 0 : std::min(cursor.depth, common);
  cursor.nodes[0] = 0;
  cursor.cell = cell;
  std::uint32_t node = cursor.nodes[static_cast<std::size_t>(depth)];
  ++cursor.steps;
  while (nodes_[node].child != 0) {
    const int bit = top - 1 - depth;
    const std::uint32_t octant =
        ((cell[0] >> bit) & 1) | (((cell[1] >> bit) & 1) << 1) | (((cell[2] >> bit) & 1) << 2);
    node = nodes_[node].child + octant;
    cursor.nodes[static_cast<std::size_t>(++depth)] = node;
    ++cursor.steps;
  }
  cursor.depth = depth;
  return std::span(candidates_).subspan(nodes_[node].begin, nodes_[node].end - nodes_[node].begin);
}

void RayOctree::nearest(const glm::dvec3& point, Cursor& cursor,
                        std::vector<NearRay>& result) const {
  result.clear();
  const auto before = [](const NearRay& a, const NearRay& b) {
    return a.distance < b.distance || (a.distance == b.distance && a.ray < b.ray);
  };
  // k is small: insertion into a sorted list.
  for (const std::uint32_t ray : candidates(point, cursor)) {
    const NearRay near{ray, distanceTo(rays_[ray], point)};
    if (result.size() == settings_.k) {
      if (!before(near, result.back())) continue;
      result.pop_back();
    }
    result.insert(std::upper_bound(result.begin(), result.end(), near, before), near);
  }
}

std::vector<std::uint32_t> groupRepresentatives(std::span<const SampleRay> rays,
                                                std::span<const NearRay> nearest,
                                                const GroupLimits& limits) {
  std::vector<std::uint32_t> representatives;
  const double leastCosine = std::cos(limits.angleRad);
  for (const NearRay& near : nearest) {
    const SampleRay& ray = rays[near.ray];
    const bool known =
        std::any_of(representatives.begin(), representatives.end(), [&](std::uint32_t other) {
          return glm::distance(rays[other].origin, ray.origin) <= limits.distance &&
                 glm::dot(rays[other].direction, ray.direction) >= leastCosine;
        });
    if (!known) representatives.push_back(near.ray);
  }
  return representatives;
}

}  // namespace catoptric::methods::perturbation
