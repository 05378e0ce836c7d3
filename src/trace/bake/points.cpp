#include "trace/bake/points.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/parallel.h"
#include "core/welding.h"
#include "trace/embree/trace_scene.h"

namespace catoptric::trace {
namespace {

constexpr std::size_t kGrain = 4096;
constexpr float kOffsetPerEdge = 0.02f;  ///< of a point off its surface; ours
constexpr float kLargestOffset = 2e-4f;  ///< of the scene's diameter; ours, 2 mm in a room
constexpr float kPull = 0.1f;            ///< share of the way to the triangles' middle; ours
constexpr float kPullPerOffset = 5.0f;   ///< most that a point is pulled, in offsets; ours
/// The difference to expect between neighbours, in those of [Ward1988]; ours, measured in rooms.
constexpr float kExpectedChange = 1.5f;
constexpr int kSmoothIterations = 4;  ///< ours; more make corners darker
constexpr int kFillRings = 64;        ///< rings of invalid points that are filled; ours
constexpr int kCurveBits = 20;        ///< of each coordinate, for the Morton curve

/// The curve's code of a place in the box that begins at `lower`.
std::uint64_t mortonCode(const Vec3& place, const Vec3& lower, float size) {
  std::uint64_t code = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const float share = std::clamp((place[axis] - lower[axis]) / size, 0.0f, 1.0f);
    const auto steps =
        static_cast<std::uint64_t>(share * static_cast<float>((1 << kCurveBits) - 1));
    for (int bit = 0; bit < kCurveBits; ++bit) code |= (steps >> bit & 1u) << (3 * bit + axis);
  }
  return code;
}

/// BakePoints::ranks. The points of each of six main directions are numbered together.
std::vector<std::uint32_t> ranksOf(const frame::Geometry& geometry, const BakePoints& points) {
  std::vector<std::pair<std::uint64_t, std::uint32_t>> codes;
  codes.reserve(points.size());
  const float size = std::max(geometry.bounds.diameter(), 1e-30f);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vec3& n = points.normals[i];
    const Vec3 a = glm::abs(n);
    const int axis = a.x >= a.y && a.x >= a.z ? 0 : a.y >= a.z ? 1 : 2;
    const std::uint64_t side = 2 * axis + (n[axis] < 0.0f ? 1 : 0);
    codes.emplace_back(
        side << 3 * kCurveBits | mortonCode(points.positions[i], geometry.bounds.min, size),
        static_cast<std::uint32_t>(i));
  }
  std::sort(codes.begin(), codes.end());
  std::vector<std::uint32_t> ranks(points.size());
  for (std::size_t k = 0; k < codes.size(); ++k)
    ranks[codes[k].second] = static_cast<std::uint32_t>(k);
  return ranks;
}

/// Each value is replaced by the mean of it and its neighbours'.
void averageRing(const BakePoints& points, std::vector<float>& values) {
  std::vector<float> averaged(values.size());
  parallelFor(points.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      float sum = values[i];
      for (std::uint32_t n : points.neighboursOf(i)) sum += values[n];
      averaged[i] = sum / static_cast<float>(points.neighboursOf(i).size() + 1);
    }
  });
  values.swap(averaged);
}

}  // namespace

BakePoints makeBakePoints(const frame::Geometry& geometry) {
  BakePoints points;
  const std::size_t vertexCount = geometry.vertexCount();
  Welding welding;
  welding.weld(vertexCount, [&](std::size_t v) {
    return std::array{geometry.positions[v], geometry.attributes[v].normal};
  });
  points.pointOfVertex = std::move(welding.numbers);
  for (const std::uint32_t v : welding.firsts) {
    points.positions.push_back(geometry.positions[v]);
    points.normals.push_back(geometry.attributes[v].normal);
  }

  // Edges between points, both ways, sorted and unique; and the middle of the triangles around.
  std::vector<std::uint64_t> edges;
  edges.reserve(geometry.indices.size() * 2);
  std::vector<Vec3> middle(points.size(), Vec3(0.0f));
  std::vector<float> weight(points.size(), 0.0f);
  for (std::size_t i = 0; i + 2 < geometry.indices.size(); i += 3) {
    std::array<std::uint32_t, 3> p;
    Vec3 centroid(0.0f);
    for (int k = 0; k < 3; ++k) {
      p[k] = points.pointOfVertex[geometry.indices[i + k]];
      centroid += geometry.positions[geometry.indices[i + k]] / 3.0f;
    }
    for (int k = 0; k < 3; ++k) {
      const std::uint64_t a = p[k];
      const std::uint64_t b = p[(k + 1) % 3];
      middle[a] += centroid;
      weight[a] += 1.0f;
      if (a == b) continue;
      edges.push_back(a << 32 | b);
      edges.push_back(b << 32 | a);
    }
  }
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  points.first.assign(points.size() + 1, 0);
  points.neighbours.reserve(edges.size());
  for (std::uint64_t edge : edges) {
    ++points.first[(edge >> 32) + 1];
    points.neighbours.push_back(static_cast<std::uint32_t>(edge));
  }
  for (std::size_t i = 0; i < points.size(); ++i) points.first[i + 1] += points.first[i];

  // Off the surface, and along it away from borders, where walls stand on floors.
  const std::vector<Vec3> corners = points.positions;
  const float largest = kLargestOffset * geometry.bounds.diameter();
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vec3 normal = points.normals[i];
    Vec3 position = points.positions[i];
    float edgeSum = 0.0f;
    for (std::uint32_t n : points.neighboursOf(i)) edgeSum += glm::length(corners[n] - position);
    const std::size_t count = points.neighboursOf(i).size();
    const float edge = count > 0 ? edgeSum / static_cast<float>(count) : 0.0f;
    const float offset =
        std::max(rayOffset(position, 0.0f), std::min(largest, kOffsetPerEdge * edge));
    if (weight[i] > 0.0f) {
      Vec3 pull = (middle[i] / weight[i] - position) * kPull;
      pull -= normal * glm::dot(pull, normal);
      const float length = glm::length(pull);
      const float most = kPullPerOffset * offset;
      if (length > most) pull *= most / length;
      position += pull;
    }
    points.positions[i] = position + normal * offset;
    points.offsets.push_back(offset);
  }
  points.ranks = ranksOf(geometry, points);
  return points;
}

void fillInvalid(const BakePoints& points, std::vector<std::uint8_t> valid,
                 std::vector<Vec4>& values) {
  std::vector<std::uint32_t> open;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (valid[i] == 0) open.push_back(static_cast<std::uint32_t>(i));
  }
  for (int ring = 0; ring < kFillRings && !open.empty(); ++ring) {
    std::vector<std::uint32_t> filled;
    std::vector<std::uint32_t> left;
    std::vector<Vec4> fill;
    for (std::uint32_t i : open) {
      Vec4 sum(0.0f);
      float total = 0.0f;
      for (std::uint32_t n : points.neighboursOf(i)) {
        if (valid[n] == 0) continue;
        const float distance = glm::length(points.positions[n] - points.positions[i]);
        const float w = 1.0f / std::max(distance, 1e-12f);
        sum += w * values[n];
        total += w;
      }
      if (total > 0.0f) {
        filled.push_back(i);
        fill.push_back(sum / total);
      } else {
        left.push_back(i);
      }
    }
    if (filled.empty()) return;
    for (std::size_t k = 0; k < filled.size(); ++k) {
      values[filled[k]] = fill[k];
      valid[filled[k]] = 1;
    }
    open = std::move(left);
  }
}

float brightness(const Vec4& value) {
  const float rgb = (value.x + value.y + value.z) / 3.0f;
  return rgb > 0.0f ? rgb : value.w;
}

void smoothValues(const BakePoints& points, const ValueErrors& errors, std::vector<Vec4>& values) {
  std::vector<float> variances(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) variances[i] = errors.noise[i] * errors.noise[i];
  averageRing(points, variances);
  averageRing(points, variances);

  const std::vector<Vec4> measured = values;
  std::vector<Vec4> next(values.size());
  for (int iteration = 0; iteration < kSmoothIterations; ++iteration) {
    parallelFor(points.size(), kGrain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const float own = brightness(values[i]);
        Vec4 sum = measured[i];
        float total = 1.0f;
        for (std::uint32_t n : points.neighboursOf(i)) {
          const float apart = glm::length(points.positions[n] - points.positions[i]);
          const float turned = glm::length(points.normals[n] - points.normals[i]);
          const float change = 0.5f * apart * (errors.nearness[i] + errors.nearness[n]) + turned;
          const float expected = kExpectedChange * change * 0.5f * (own + brightness(values[n]));
          // A weight of at most 1
          const float w = variances[i] / std::max({variances[i], expected * expected, 1e-30f});
          sum += w * values[n];
          total += w;
        }
        next[i] = sum / total;
      }
    });
    values.swap(next);
  }
}

}  // namespace catoptric::trace
