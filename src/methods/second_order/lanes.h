// Four samples at a time, in the vector types that GCC and Clang share. Which samples meet in a
// lane follows from their place in a run alone: results depend on no number of threads.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "core/math.h"

namespace catoptric::methods {

constexpr std::size_t kLanes = 4;
using Lanes = float __attribute__((vector_size(16)));
using LaneMask = std::int32_t __attribute__((vector_size(16)));  ///< -1 or 0, as by Lanes < Lanes

struct Lanes2 {
  Lanes x, y;
};
struct Lanes3 {
  Lanes x, y, z;
};

inline Lanes lanes(float value) {
  return Lanes{value, value, value, value};
}
/// Up to four of `left` >= 1 values; the last one again where there are fewer.
inline Lanes load(const float* values, std::size_t left) {
  Lanes loaded;
  if (left >= kLanes) {
    __builtin_memcpy(&loaded, values, sizeof loaded);
  } else {
    for (std::size_t k = 0; k < kLanes; ++k) loaded[k] = values[std::min(k, left - 1)];
  }
  return loaded;
}
inline void store(const Lanes& value, float* out, std::size_t left) {
  for (std::size_t k = 0; k < std::min(left, kLanes); ++k) out[k] = value[k];
}
/// Lanes that hold one of `left` values, not the last one again.
inline LaneMask valid(std::size_t left) {
  const auto n = static_cast<std::int32_t>(std::min(left, kLanes));
  return LaneMask{0, 1, 2, 3} < LaneMask{n, n, n, n};
}

/// `b` where `a` is not a number.
inline Lanes least(const Lanes& a, const Lanes& b) {
  return a < b ? a : b;
}
inline Lanes most(const Lanes& a, const Lanes& b) {
  return a > b ? a : b;
}
inline Lanes root(const Lanes& a) {
  return Lanes{std::sqrt(a[0]), std::sqrt(a[1]), std::sqrt(a[2]), std::sqrt(a[3])};
}
inline Lanes dot(const Lanes3& a, const Lanes3& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
inline Lanes dot(const Lanes3& a, const Vec3& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
inline Lanes3 minus(const Lanes3& a, const Vec3& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}

inline bool allOf(const LaneMask& mask) {
  return (mask[0] & mask[1] & mask[2] & mask[3]) != 0;
}
inline bool noneOf(const LaneMask& mask) {
  return (mask[0] | mask[1] | mask[2] | mask[3]) == 0;
}

inline float sumOf(const Lanes& a) {
  return (a[0] + a[1]) + (a[2] + a[3]);
}
inline float leastOf(const Lanes& a) {
  return std::min(std::min(a[0], a[1]), std::min(a[2], a[3]));
}
inline float mostOf(const Lanes& a) {
  return std::max(std::max(a[0], a[1]), std::max(a[2], a[3]));
}

}  // namespace catoptric::methods
