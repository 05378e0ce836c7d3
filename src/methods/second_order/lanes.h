// Processes four samples at a time. The assignment of samples to lanes depends only on their
// position in a contiguous range, so results do not depend on the number of threads.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "core/lanes.h"
#include "core/math.h"

namespace catoptric::methods {

constexpr std::size_t kLanes = 4;

struct Lanes2 {
  Floats4 x, y;
};
struct Lanes3 {
  Floats4 x, y, z;
};

/// Up to four of `left` >= 1 values; if fewer are left, the last one is repeated.
inline Floats4 load(const float* values, std::size_t left) {
  Floats4 loaded;
  if (left >= kLanes) {
    loaded = catoptric::load<Floats4>(values);
  } else {
    for (std::size_t k = 0; k < kLanes; ++k) loaded[k] = values[std::min(k, left - 1)];
  }
  return loaded;
}
inline void store(const Floats4& value, float* out, std::size_t left) {
  for (std::size_t k = 0; k < std::min(left, kLanes); ++k) out[k] = value[k];
}
/// The lanes that contain one of `left` values, without repetitions.
inline Mask4 valid(std::size_t left) {
  const auto n = static_cast<std::int32_t>(std::min(left, kLanes));
  return Mask4{0, 1, 2, 3} < n;
}

inline Floats4 dot(const Lanes3& a, const Lanes3& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
inline Floats4 dot(const Lanes3& a, const Vec3& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
inline Lanes3 minus(const Lanes3& a, const Vec3& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}

inline bool allOf(const Mask4& mask) {
  return (mask[0] & mask[1] & mask[2] & mask[3]) != 0;
}
inline bool noneOf(const Mask4& mask) {
  return (mask[0] | mask[1] | mask[2] | mask[3]) == 0;
}

inline float sumOf(const Floats4& a) {
  return (a[0] + a[1]) + (a[2] + a[3]);
}
inline float leastOf(const Floats4& a) {
  return std::min(std::min(a[0], a[1]), std::min(a[2], a[3]));
}
inline float mostOf(const Floats4& a) {
  return std::max(std::max(a[0], a[1]), std::max(a[2], a[3]));
}

}  // namespace catoptric::methods
