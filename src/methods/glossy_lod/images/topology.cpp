#include "methods/glossy_lod/images/topology.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <numeric>

#include "core/welding.h"

namespace catoptric::methods::glossy_lod {
namespace {

/// Cosine of the angle to a chart's mean normal at which it ends. Ours: 70 degrees.
constexpr float kBend = 0.34f;

/// Grows one chart after the other, triangle by triangle.
class Growth {
 public:
  Growth(const MeshView& mesh, const Topology& topology, const std::vector<std::uint32_t>& groupOf,
         std::vector<std::int32_t>& chartOf)
      : topology_(topology), groupOf_(groupOf), chartOf_(chartOf), normal_(mesh.triangles()) {
    for (std::size_t t = 0; t < normal_.size(); ++t)
      normal_[t] = mesh.normals.empty() ? areaNormal(mesh, t)
                                        : glm::length(areaNormal(mesh, t)) * smoothNormal(mesh, t);
    lastChart_.assign(mesh.positions.size(), kNobody);
  }

  void grow(std::size_t seed, std::int32_t chart) {
    mean_ = Vec3(0.0f);
    front_.clear();
    add(seed, chart);
    while (!front_.empty()) {
      const std::size_t side = front_.front();
      front_.pop_front();
      const std::int32_t other = topology_.across[side];
      const auto t = static_cast<std::size_t>(other) / 3;
      if (chartOf_[t] != kNobody || topology_.degenerate[t] || groupOf_[t] != groupOf_[seed])
        continue;
      if (!bendsLittle(side / 3, t) || !staysDisk(t, chart)) continue;
      add(t, chart);
    }
  }

 private:
  void add(std::size_t t, std::int32_t chart) {
    chartOf_[t] = chart;
    mean_ += normal_[t];
    for (std::size_t c = 3 * t; c < 3 * t + 3; ++c) {
      lastChart_[topology_.vertex[c]] = chart;
      if (topology_.across[c] != kNobody) front_.push_back(c);
    }
  }

  bool bendsLittle(std::size_t from, std::size_t to) const {
    const Vec3 n = normalizedOr(normal_[to], Vec3(0.0f));
    return glm::dot(n, normalizedOr(normal_[from], Vec3(0.0f))) >= kCrease &&
           glm::dot(n, normalizedOr(mean_, Vec3(0.0f))) >= kBend;
  }

  /// A triangle keeps the disk if it touches it by one side and its opposite corner is new, or by
  /// two sides.
  bool staysDisk(std::size_t t, std::int32_t chart) const {
    int sides = 0;
    std::size_t shared = 0;
    for (std::size_t c = 3 * t; c < 3 * t + 3; ++c) {
      const std::int32_t other = topology_.across[c];
      if (other == kNobody || chartOf_[static_cast<std::size_t>(other) / 3] != chart) continue;
      ++sides;
      shared = c;
    }
    if (sides == 2) return true;
    const std::size_t opposite = nextCorner(nextCorner(shared));
    return sides == 1 && lastChart_[topology_.vertex[opposite]] != chart;
  }

  const Topology& topology_;
  const std::vector<std::uint32_t>& groupOf_;
  std::vector<std::int32_t>& chartOf_;
  std::vector<Vec3> normal_;
  std::vector<std::int32_t> lastChart_;  ///< by vertex: the last chart that it became part of
  Vec3 mean_{0.0f};
  std::deque<std::size_t> front_;  ///< sides to look across
};

}  // namespace

Vec3 areaNormal(const MeshView& mesh, std::size_t t) {
  const Vec3 a = mesh.positions[mesh.indices[3 * t]];
  return glm::cross(mesh.positions[mesh.indices[3 * t + 1]] - a,
                    mesh.positions[mesh.indices[3 * t + 2]] - a);
}

Vec3 smoothNormal(const MeshView& mesh, std::size_t t) {
  const Vec3 flat = normalizedOr(areaNormal(mesh, t), Vec3(0.0f));
  if (mesh.normals.empty()) return flat;
  // Those of slivers say little
  const std::uint32_t* v = &mesh.indices[3 * t];
  return normalizedOr(mesh.normals[v[0]] + mesh.normals[v[1]] + mesh.normals[v[2]], flat);
}

Topology findTopology(const MeshView& mesh) {
  Topology topology;
  Welding welding;
  welding.weld(mesh.indices.size(),
               [&](std::size_t c) { return std::array{mesh.positions[mesh.indices[c]]}; });
  for (const std::uint32_t number : welding.numbers)
    topology.vertex.push_back(mesh.indices[welding.firsts[number]]);
  const std::size_t corners = mesh.indices.size();
  topology.across.assign(corners, kNobody);
  topology.edge.assign(corners, 0);
  topology.degenerate.assign(mesh.triangles(), false);
  for (std::size_t t = 0; t < mesh.triangles(); ++t) {
    const std::uint32_t* v = &topology.vertex[3 * t];
    topology.degenerate[t] =
        v[0] == v[1] || v[1] == v[2] || v[2] == v[0] || !(glm::length(areaNormal(mesh, t)) > 0.0f);
  }

  // Sides by their vertices: those of an edge follow each other
  const auto ends = [&](std::size_t c) {
    const std::uint32_t a = topology.vertex[c];
    const std::uint32_t b = topology.vertex[nextCorner(c)];
    return std::uint64_t{std::min(a, b)} << 32 | std::max(a, b);
  };
  std::vector<std::uint32_t> order;
  for (std::size_t c = 0; c < corners; ++c)
    if (!topology.degenerate[c / 3]) order.push_back(static_cast<std::uint32_t>(c));
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    const std::uint64_t ea = ends(a);
    const std::uint64_t eb = ends(b);
    return ea != eb ? ea < eb : a < b;
  });
  for (std::size_t begin = 0; begin < order.size();) {
    std::size_t end = begin;
    while (end < order.size() && ends(order[end]) == ends(order[begin])) {
      topology.edge[order[end]] = static_cast<std::uint32_t>(topology.edges);
      ++end;
    }
    const std::uint32_t a = order[begin];
    const std::uint32_t b = order[end - 1];
    if (end - begin == 2 && topology.vertex[a] == topology.vertex[nextCorner(b)]) {
      topology.across[a] = static_cast<std::int32_t>(b);
      topology.across[b] = static_cast<std::int32_t>(a);
    }
    ++topology.edges;
    begin = end;
  }
  return topology;
}

std::int32_t growCharts(const MeshView& mesh, const Topology& topology,
                        const std::vector<std::uint32_t>& groupOf, std::int32_t charts,
                        std::vector<std::int32_t>& chartOf) {
  Growth growth(mesh, topology, groupOf, chartOf);
  for (std::size_t t = 0; t < mesh.triangles(); ++t) {
    if (chartOf[t] == kNobody && !topology.degenerate[t]) growth.grow(t, charts++);
  }
  return charts;
}

}  // namespace catoptric::methods::glossy_lod
