#include "methods/perturbation/ray_octree.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <numeric>
#include <queue>
#include <utility>

#include "core/parallel.h"

namespace catoptric::methods::perturbation {
namespace {

/// Distances of doubles may be off by this part of the coordinates' size.
constexpr double kRounding = 1e-14;

/// ... and squares of them in floats by this part of the squared distances from the box.
constexpr float kGlanceRounding = 3e-6f;

/// Squared distances of a point (relative to the box) from rays, and their nearest parameters. Rays
/// that end are taken for longer: that is nearer, and a wider beam.
Floats4 distances2(const RayOctree::FourGlances& rays, const glm::vec3& p, Floats4& t) {
  const Floats4 x = p.x - rays[0];
  const Floats4 y = p.y - rays[1];
  const Floats4 z = p.z - rays[2];
  t = x * rays[4] + y * rays[5] + z * rays[6];
  t = t > 0.0f ? t : Floats4{};
  return x * x + y * y + z * z - t * t;
}

/// Cursor::seen
std::uint64_t seenAt(std::uint32_t lookUp, float distance2) {
  return static_cast<std::uint64_t>(lookUp) << 32 |
         std::bit_cast<std::uint32_t>(std::max(distance2, 0.0f));
}

/// Beams that are told by their base and growth are that much wider.
constexpr double kBeamRounding = 1.0 + 1e-9;
/// Sets of more rays are divided by several threads.
constexpr std::size_t kManyRays = 2048;

bool isNearer(const NearRay& a, const NearRay& b) {
  return a.distance < b.distance || (a.distance == b.distance && a.ray < b.ray);
}

}  // namespace

RayOctree::RayOctree(std::vector<SampleRay> rays, const glm::dvec3& min, const glm::dvec3& max,
                     const Settings& settings, std::vector<Neighbours> neighbours)
    : rays_(std::move(rays)),
      neighbours_(std::move(neighbours)),
      min_(min),
      size_(max - min),
      settings_(settings) {
  assert(neighbours_.empty() || neighbours_.size() == rays_.size());
  assert(settings_.k > 0 && settings_.maxDepth >= 0 && settings_.maxDepth < 31);
  assert(std::all_of(rays_.begin(), rays_.end(), [](const SampleRay& r) {
    return std::isfinite(glm::dot(r.origin, glm::dvec3(1.0))) &&
           std::isfinite(glm::dot(r.direction, glm::dvec3(1.0))) && r.length >= 0.0;
  }));
  all_.resize(rays_.size());
  std::iota(all_.begin(), all_.end(), 0u);
  build();
}

bool RayOctree::inBeam(std::uint32_t ray, double t, double distance) const {
  const glm::dvec3 centre = rays_[ray].origin + t * rays_[ray].direction;
  return std::any_of(neighbours_[ray].begin(), neighbours_[ray].end(), [&](std::uint32_t other) {
    return other != kNoRay && distanceTo(rays_[other], centre) >= distance;
  });
}

std::vector<std::uint32_t> RayOctree::candidateSet(const glm::dvec3& centre, double radius,
                                                   const std::vector<std::uint32_t>& from) const {
  if (!neighbours_.empty()) {
    // A point within the radius is at most so much nearer to the ray, and its nearest point on the
    // ray moves at most so far, to where the beam is at most so much wider.
    const double far = glm::length(centre);
    std::vector<std::uint32_t> beams;
    for (const std::uint32_t ray : from) {
      const double t = nearestParameter(rays_[ray], centre);
      const glm::dvec3 nearest = rays_[ray].origin + t * rays_[ray].direction;
      const double distance = glm::distance(nearest, centre);
      const auto reaches = [&](double beam) {
        return distance <= beam + 2.0 * radius + kRounding * (far + distance + beam);
      };
      // Most are told without their neighbours
      const Beam& most = beams_[ray];
      const bool within =
          reaches(0.0) ||
          (reaches(kBeamRounding * (most.base + most.growth * t)) &&
           std::any_of(neighbours_[ray].begin(), neighbours_[ray].end(), [&](std::uint32_t other) {
             return other != kNoRay && reaches(distanceTo(rays_[other], nearest));
           }));
      if (within) beams.push_back(ray);
    }
    return beams;
  }
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
  around_ = neighbours_;
  for (std::size_t i = 0; i < neighbours_.size(); ++i) {
    std::replace(around_[i].begin(), around_[i].end(), kNoRay, static_cast<std::uint32_t>(i));
    Beam beam;
    for (const std::uint32_t other : neighbours_[i]) {
      if (other == kNoRay) continue;
      // Beyond the end of one that ends earlier it is its end that counts
      const double shorter =
          rays_[other].length < rays_[i].length ? rays_[i].length - rays_[other].length : 0.0;
      beam.base =
          std::max(beam.base, glm::distance(rays_[i].origin, rays_[other].origin) + shorter);
      beam.growth =
          std::max(beam.growth, glm::distance(rays_[i].direction, rays_[other].direction));
    }
    beams_.push_back(beam);
    const glm::vec3 origin(rays_[i].origin - min_);
    const glm::vec3 direction(rays_[i].direction);
    farthest2_ = std::max(farthest2_, glm::dot(origin, origin));
    endless_ = endless_ && std::isinf(rays_[i].length);
    glances_.push_back({{origin.x, origin.y, origin.z, static_cast<float>(beam.base)},
                        {direction.x, direction.y, direction.z, static_cast<float>(beam.growth)}});
  }
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
    std::array<Cell, 8> children;
    const auto divide = [&](std::size_t begin, std::size_t end) {
      for (std::size_t octant = begin; octant < end; ++octant) {
        const glm::dvec3 centre =
            parent.centre + half * glm::dvec3((octant & 1) ? 1.0 : -1.0, (octant & 2) ? 1.0 : -1.0,
                                              (octant & 4) ? 1.0 : -1.0);
        children[octant] = {centre, half, parent.depth + 1,
                            candidateSet(centre, glm::length(half), parent.rays)};
      }
    };
    if (parent.rays.size() > kManyRays) {
      parallelFor(children.size(), 1, divide);
    } else {
      divide(0, children.size());
    }
    for (Cell& child : children) {
      nodes_.emplace_back();
      cells.push_back(std::move(child));
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
                      glm::all(glm::lessThanEqual(relative, glm::dvec3(1.0)));
  if (!inside) {
    ++cursor.outside;
    return all_;
  }
  const int top = settings_.maxDepth;
  std::array<std::uint32_t, 3> cell{};
  std::uint32_t different = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    // The last cell has its far side too: bounds of scenes touch it
    cell[i] = std::min(static_cast<std::uint32_t>(static_cast<double>(1u << top) * relative[axis]),
                       (1u << top) - 1);
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
  assert(neighbours_.empty());
  result.clear();
  // k is small: insertion into a sorted list.
  for (const std::uint32_t ray : candidates(point, cursor)) {
    const NearRay near{ray, distanceTo(rays_[ray], point)};
    if (result.size() == settings_.k) {
      if (!isNearer(near, result.back())) continue;
      result.pop_back();
    }
    result.insert(std::upper_bound(result.begin(), result.end(), near, isNearer), near);
  }
}

void RayOctree::beamsAt(const glm::dvec3& point, std::span<const std::uint32_t> from,
                        Cursor& cursor) const {
  --cursor.lookUp;
  cursor.near.clear();
  if (from.empty()) return;
  // Points near to each other have the same candidates
  if (cursor.packedFrom != from.data()) {
    cursor.packedFrom = from.data();
    cursor.packed.resize((from.size() + 3) / 4);
    for (std::size_t first = 0; first < from.size(); first += 4) {
      std::array<std::uint32_t, 4> four{};
      for (std::size_t lane = 0; lane < 4; ++lane)
        four[lane] = from[std::min(first + lane, from.size() - 1)];
      cursor.packed[first / 4] = fourGlances(four);
    }
  }
  const glm::vec3 p(point - min_);
  const float size2 = glm::dot(p, p);
  std::vector<std::uint32_t>& result = cursor.near;
  result.resize(from.size() + 1);
  cursor.seen.resize(rays_.size(), ~std::uint64_t{0});
  std::size_t count = 0;
  for (std::size_t first = 0; first < from.size(); first += 4) {
    const FourGlances& rays = cursor.packed[first / 4];
    Floats4 t;
    const Floats4 away2 = distances2(rays, p, t);
    const Floats4 radius = rays[3] + rays[7] * t;
    const Floats4 slack =
        kGlanceRounding * (size2 + rays[0] * rays[0] + rays[1] * rays[1] + rays[2] * rays[2]);
    const auto passed = away2 > radius * radius + slack;
    const std::size_t lanes = std::min<std::size_t>(4, from.size() - first);
    for (std::size_t lane = 0; lane < lanes; ++lane) {
      const std::uint32_t ray = from[first + lane];
      result[count] = ray;
      cursor.seen[ray] = seenAt(cursor.lookUp, away2[lane]);
      count += passed[lane] == 0 ? 1 : 0;
    }
  }
  result.resize(count);
}

RayOctree::FourGlances RayOctree::fourGlances(const std::array<std::uint32_t, 4>& rays) const {
  FourGlances four;
  for (std::size_t lane = 0; lane < 4; ++lane) {
    const Glance& glance = glances_[rays[lane]];
    four[lane] = load<Floats4>(glance.origin.data());
    four[lane + 4] = load<Floats4>(glance.direction.data());
  }
  transpose(four[0], four[1], four[2], four[3]);
  transpose(four[4], four[5], four[6], four[7]);
  return four;
}

bool RayOctree::surelyAnswer(const glm::vec3& p, const NearRay& near, float doubt) const {
  const auto distance2 = static_cast<float>(near.distance * near.distance);
  const Neighbours& around = around_[near.ray];
  bool wide = false;
  for (std::size_t first = 0; first < around.size(); first += 4) {
    Floats4 t;
    const Floats4 away2 = distances2(
        fourGlances({around[first], around[first + 1], around[first + 2], around[first + 3]}), p,
        t);
    for (std::size_t lane = 0; lane < 4; ++lane) {
      if (around[first + lane] == near.ray) continue;
      if (!(away2[lane] > distance2 + doubt)) return false;
      // So far from the point, it is farther from the ray than the point is
      wide = wide || away2[lane] > 4.0f * distance2 + doubt;
    }
  }
  return wide;
}

void RayOctree::reflections(const glm::dvec3& point, Cursor& cursor,
                            std::vector<NearRay>& result) const {
  assert(neighbours_.size() == rays_.size());
  result.clear();
  beamsAt(point, candidates(point, cursor), cursor);
  const glm::vec3 p(point - min_);
  const float doubt = 2.0f * kGlanceRounding * (glm::dot(p, p) + farthest2_);
  for (const std::uint32_t ray : cursor.near) {
    // Most have a neighbour that is certainly nearer. All are looked at: branches cost more
    std::uint64_t least = ~std::uint64_t{0};
    for (const std::uint32_t other : around_[ray]) least = std::min(least, cursor.seen[other]);
    const float own2 = std::bit_cast<float>(static_cast<std::uint32_t>(cursor.seen[ray]));
    if (endless_ && least < seenAt(cursor.lookUp, own2 - doubt)) continue;
    const double t = nearestParameter(rays_[ray], point);
    const NearRay near{ray, glm::length(rays_[ray].origin + t * rays_[ray].direction - point)};
    // Most beams are passed by.
    constexpr double kSlack = 1.0 + 1e-9;
    if (near.distance > kSlack * (beams_[ray].base + beams_[ray].growth * t)) continue;
    if (surelyAnswer(p, near, doubt)) {
      result.push_back(near);
      continue;
    }
    const bool minimum =
        std::none_of(neighbours_[ray].begin(), neighbours_[ray].end(), [&](std::uint32_t other) {
          return other != kNoRay && isNearer({other, distanceTo(rays_[other], point)}, near);
        });
    if (minimum && inBeam(ray, t, near.distance)) result.push_back(near);
  }
  std::sort(result.begin(), result.end(), isNearer);
}

std::vector<Neighbours> gridNeighbours(int width, int height,
                                       std::span<const std::uint32_t> rayAt) {
  assert(rayAt.size() == static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  const auto at = [&](int x, int y) {
    return x < 0 || y < 0 || x >= width || y >= height
               ? kNoRay
               : rayAt[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                       static_cast<std::size_t>(x)];
  };
  std::vector<Neighbours> neighbours;
  std::vector<bool> done;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const std::uint32_t ray = at(x, y);
      if (ray == kNoRay) continue;
      if (ray >= neighbours.size()) {
        neighbours.resize(ray + std::size_t{1});
        done.resize(neighbours.size());
      }
      if (done[ray]) continue;
      done[ray] = true;
      // This is its upper left corner
      int end = x + 1;
      while (at(end, y) == ray) ++end;
      const int size = end - x;
      const int below = y + size;
      const int column = x + size / 2;
      const int row = y + size / 2;
      neighbours[ray] = {at(x - 1, y - 1), at(column, y - 1), at(end, y - 1),    at(x - 1, row),
                         at(end, row),     at(x - 1, below),  at(column, below), at(end, below)};
    }
  }
  return neighbours;
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
