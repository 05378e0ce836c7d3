// Low-discrepancy points, and the map from the unit square to the disk.
#pragma once

#include <cmath>
#include <cstdint>

#include "core/math.h"

namespace catoptric {

/// The increments of the two-dimensional R2 sequence [Roberts2018].
inline constexpr double kR2x = 0.7548776662466927;
inline constexpr double kR2y = 0.5698402909980532;
/// These increments in units of 2^-32, for sums modulo 1 without rounding.
inline constexpr auto kR2xBits = static_cast<std::uint32_t>(kR2x * 4294967296.0);
inline constexpr auto kR2yBits = static_cast<std::uint32_t>(kR2y * 4294967296.0);

/// Van der Corput sequence in base 2, in [0, 1): the bits of `i` mirrored at the binary point.
inline float radicalInverse2(std::uint32_t i) {
  i = i << 16 | i >> 16;
  i = (i & 0x00FF00FFu) << 8 | (i & 0xFF00FF00u) >> 8;
  i = (i & 0x0F0F0F0Fu) << 4 | (i & 0xF0F0F0F0u) >> 4;
  i = (i & 0x33333333u) << 2 | (i & 0xCCCCCCCCu) >> 2;
  i = (i & 0x55555555u) << 1 | (i & 0xAAAAAAAAu) >> 1;
  return static_cast<float>(i >> 8) * (1.0f / 16777216.0f);
}

/// `x` modulo 1, for `x` in [0, 2).
inline float wrapUnit(float x) {
  return x >= 1.0f ? x - 1.0f : x;
}

/// Maps the unit square to the unit disk; area-preserving and continuous [Shirley1997].
inline Vec2 concentricDisk(const Vec2& p) {
  const float a = 2.0f * p.x - 1.0f;
  const float b = 2.0f * p.y - 1.0f;
  if (a == 0.0f && b == 0.0f) return Vec2(0.0f);
  float radius = a;
  float angle = 0.0f;
  if (std::abs(a) > std::abs(b)) {
    angle = kPi / 4.0f * (b / a);
  } else {
    radius = b;
    angle = kPi / 2.0f - kPi / 4.0f * (a / b);
  }
  return {radius * std::cos(angle), radius * std::sin(angle)};
}

}  // namespace catoptric
