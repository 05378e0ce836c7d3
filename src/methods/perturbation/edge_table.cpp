#include "methods/perturbation/edge_table.h"

#include <algorithm>
#include <numeric>
#include <tuple>
#include <utility>

namespace catoptric::methods::perturbation {
namespace {

/// A part of the triangles that meets fewer than one place in so many is sorted by comparisons
/// (ours).
constexpr std::size_t kFewTriangles = 16;

/// The order of sides by their first end, then the second; of equal ones as they are given.
std::vector<std::uint32_t> sortedSides(const std::vector<Connectivity::Edge>& sides,
                                       std::size_t triangles, std::size_t places) {
  std::vector<std::uint32_t> sorted(sides.size());
  if (kFewTriangles * triangles < places) {
    std::iota(sorted.begin(), sorted.end(), 0u);
    std::sort(sorted.begin(), sorted.end(), [&](std::uint32_t i, std::uint32_t j) {
      return std::tie(sides[i].a, sides[i].b, i) < std::tie(sides[j].a, sides[j].b, j);
    });
  } else {
    // By counting, by their second ends and then, in that order, by their first
    std::vector<std::uint32_t> firsts(places);
    std::vector<std::uint32_t> seconds(places);
    for (const Connectivity::Edge& side : sides) {
      ++firsts[side.a];
      ++seconds[side.b];
    }
    const auto addUp = [](std::vector<std::uint32_t>& counts) {
      std::uint32_t sum = 0;
      for (std::uint32_t& count : counts) sum += std::exchange(count, sum);
    };
    addUp(firsts);
    addUp(seconds);
    std::vector<std::uint32_t> bySecond(sides.size());
    for (std::uint32_t i = 0; i < sides.size(); ++i) bySecond[seconds[sides[i].b]++] = i;
    for (const std::uint32_t i : bySecond) sorted[firsts[sides[i].a]++] = i;
  }
  return sorted;
}

}  // namespace

Connectivity::Edges edgesOf(const VertexTable& table,
                            const std::vector<Connectivity::Triangle>& triangles) {
  std::vector<Connectivity::Edge> sides(3 * triangles.size());
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    const std::array<std::uint32_t, 3> at{table.placeOf(triangles[t][0]),
                                          table.placeOf(triangles[t][1]),
                                          table.placeOf(triangles[t][2])};
    for (std::size_t c = 0; c < 3; ++c) {
      const auto [a, b] = std::minmax(at[c], at[(c + 1) % 3]);
      sides[3 * t + c] = {a, b};
    }
  }
  const std::vector<std::uint32_t> sorted =
      sortedSides(sides, triangles.size(), table.places.size());
  Connectivity::Edges edges;
  edges.ends.reserve(sides.size() / 2 + 64);
  edges.of.resize(sides.size());
  for (const std::uint32_t i : sorted) {
    const auto [a, b] = sides[i];
    if (edges.ends.empty() || edges.ends.back().a != a || edges.ends.back().b != b)
      edges.ends.push_back({a, b});
    edges.of[i] = static_cast<std::uint32_t>(edges.ends.size() - 1);
  }
  return edges;
}

}  // namespace catoptric::methods::perturbation
