// Bits for the random shifts of sample points: a hash, so that a pixel's or a point's numbers do
// not depend on the order in which threads reach it.
#pragma once

#include <cstdint>

namespace catoptric {

/// A well mixed number of 32 bits [Jarzynski2020, pcg].
inline std::uint32_t mixedBits(std::uint32_t v) {
  const std::uint32_t state = v * 747796405u + 2891336453u;
  const std::uint32_t word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
  return (word >> 22u) ^ word;
}

/// In [0, 1), from the upper 24 bits: exact in float, never rounded up to 1.
inline float unitFloat(std::uint32_t bits) {
  return static_cast<float>(bits >> 8) * (1.0f / 16777216.0f);
}

}  // namespace catoptric
