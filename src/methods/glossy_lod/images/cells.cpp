#include "methods/glossy_lod/images/cells.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/parallel.h"

namespace catoptric::methods::glossy_lod {
namespace {

/// Rounds of [Lloyd1982]. Ours: more change cells little.
constexpr int kRounds = 8;
/// Difference of normals that separates as a cell's radius does. Ours: charts end at 1.15.
constexpr double kNormalRadius = 0.5;
/// Times that the cells' borders are smoothed. Ours.
constexpr int kSmoothings = 4;

/// TrianglePlace and normal of a triangle or of a cell, in units that separate alike.
using Point = std::array<float, 6>;

/// Points of all triangles, and their areas.
struct Points {
  std::vector<Point> at;
  std::vector<double> area;
};

Points pointsOf(const MeshView& mesh, const Topology& topology, std::size_t cells) {
  Points points;
  points.at.resize(mesh.triangles());
  points.area.assign(mesh.triangles(), 0.0);
  double total = 0.0;
  for (std::size_t t = 0; t < mesh.triangles(); ++t) {
    if (topology.degenerate[t]) continue;
    points.area[t] = 0.5 * static_cast<double>(glm::length(areaNormal(mesh, t)));
    total += points.area[t];
  }
  const double radius = std::sqrt(total / (static_cast<double>(cells) * kPi));
  const Vec3 corner = mesh.positions[mesh.indices[0]];
  for (std::size_t t = 0; t < mesh.triangles(); ++t) {
    const std::uint32_t* v = &mesh.indices[3 * t];
    const Vec3 middle = ((mesh.positions[v[0]] - corner) + (mesh.positions[v[1]] - corner) +
                         (mesh.positions[v[2]] - corner)) /
                        (3.0f * static_cast<float>(std::max(radius, 1e-30)));
    const Vec3 normal = smoothNormal(mesh, t) / static_cast<float>(kNormalRadius);
    points.at[t] = {middle.x, middle.y, middle.z, normal.x, normal.y, normal.z};
  }
  return points;
}

std::uint32_t nearest(const Point& point, const std::vector<Point>& cells) {
  float least = std::numeric_limits<float>::infinity();
  std::uint32_t best = 0;
  for (std::size_t c = 0; c < cells.size(); ++c) {
    float distance = 0.0f;
    for (std::size_t k = 0; k < point.size(); ++k) {
      const float d = point[k] - cells[c][k];
      distance += d * d;
    }
    if (!(distance < least)) continue;
    least = distance;
    best = static_cast<std::uint32_t>(c);
  }
  return best;
}

/// Each cell moves to the mean of its triangles; one without any stays where it is.
void moveToMeans(const Points& points, const std::vector<std::uint32_t>& cellOf,
                 std::vector<Point>& cells) {
  std::vector<std::array<double, 7>> sums(cells.size());
  for (std::size_t t = 0; t < cellOf.size(); ++t) {
    std::array<double, 7>& sum = sums[cellOf[t]];
    for (std::size_t k = 0; k < 6; ++k)
      sum[k] += points.area[t] * static_cast<double>(points.at[t][k]);
    sum[6] += points.area[t];
  }
  for (std::size_t c = 0; c < cells.size(); ++c)
    for (std::size_t k = 0; k < 6 && sums[c][6] > 0.0; ++k)
      cells[c][k] = static_cast<float>(sums[c][k] / sums[c][6]);
}

/// Triangles that hang on their cell by one side at most go to the cell that has the other two:
/// charts that grow triangle by triangle leave out such tips.
void smooth(const Topology& topology, std::vector<std::uint32_t>& cellOf) {
  for (int round = 0; round < kSmoothings; ++round) {
    for (std::size_t t = 0; t < cellOf.size(); ++t) {
      for (std::size_t i = 0; i < 3; ++i) {
        const std::int32_t a = topology.across[3 * t + i];
        const std::int32_t b = topology.across[3 * t + (i + 1) % 3];
        if (a == kNobody || b == kNobody) continue;
        const std::uint32_t other = cellOf[static_cast<std::size_t>(a) / 3];
        if (other == cellOf[static_cast<std::size_t>(b) / 3]) cellOf[t] = other;
      }
    }
  }
}

}  // namespace

std::vector<std::uint32_t> findCells(const MeshView& mesh, const Topology& topology,
                                     std::size_t cells) {
  const Points points = pointsOf(mesh, topology, cells);
  std::vector<Point> middles;
  // Spread over the triangles' numbers by the golden ratio, so that no row of a grid is preferred
  constexpr double kGolden = 0.6180339887498949;
  for (std::size_t c = 0; c < cells; ++c) {
    const double share = static_cast<double>(c + 1) * kGolden;
    middles.push_back(points.at[static_cast<std::size_t>((share - std::floor(share)) *
                                                         static_cast<double>(points.at.size()))]);
  }
  std::vector<std::uint32_t> cellOf(points.at.size(), 0);
  for (int round = 0; round <= kRounds; ++round) {
    parallelFor(cellOf.size(), 4096, [&](std::size_t begin, std::size_t end) {
      for (std::size_t t = begin; t < end; ++t) cellOf[t] = nearest(points.at[t], middles);
    });
    if (round < kRounds) moveToMeans(points, cellOf, middles);
  }
  smooth(topology, cellOf);
  return cellOf;
}

}  // namespace catoptric::methods::glossy_lod
