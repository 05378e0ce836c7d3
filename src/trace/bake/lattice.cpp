#include "trace/bake/lattice.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "core/random.h"
#include "core/sampling.h"

namespace catoptric::trace {

float fraction(double x) {
  return static_cast<float>(x - std::floor(x));
}

Vec2 sequenceShift(std::uint64_t first) {
  const auto n = static_cast<std::uint32_t>(first);
  return {unitFloat(n * kR2xBits), unitFloat(n * kR2yBits)};
}

float standardError(const std::array<float, kGroups>& sums, float scale) {
  float mean = 0.0f;
  for (float s : sums) mean += s / kGroups;
  float squares = 0.0f;
  for (float s : sums) squares += (s - mean) * (s - mean);
  // The whole is kGroups times a group's mean; variance of the sum of groups, scaled.
  return scale * std::sqrt(squares * kGroups / (kGroups - 1));
}

Vec2 shifted(const Vec2& p, const Vec2& shift) {
  const Vec2 q = p + shift;
  return {q.x >= 1.0f ? q.x - 1.0f : q.x, q.y >= 1.0f ? q.y - 1.0f : q.y};
}

std::vector<Vec2> latticePoints(int count, int first) {
  std::vector<Vec2> points(count);
  for (int i = 0; i < count; ++i)
    points[i] = {fraction(0.5 + (first + i) * kR2x), fraction(0.5 + (first + i) * kR2y)};
  const auto morton = [](const Vec2& p) {
    const auto x = static_cast<std::uint32_t>(p.x * 256.0f);
    const auto y = static_cast<std::uint32_t>(p.y * 256.0f);
    std::uint32_t code = 0;
    for (int bit = 0; bit < 8; ++bit) {
      code |= (x >> bit & 1u) << (2 * bit) | (y >> bit & 1u) << (2 * bit + 1);
    }
    return code;
  };
  std::stable_sort(points.begin(), points.end(),
                   [&](const Vec2& a, const Vec2& b) { return morton(a) < morton(b); });
  return points;
}

Vec3 cosineDirection(const Basis& basis, const Vec2& p) {
  const Vec2 d = concentricDisk(p);
  return basis.x * d.x + basis.y * d.y +
         basis.z * std::sqrt(std::max(0.0f, 1.0f - d.x * d.x - d.y * d.y));
}

}  // namespace catoptric::trace
