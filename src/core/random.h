// Random bits that shift sample points. They come from a hash, so the numbers of a pixel or point
// do not depend on the order in which threads process it.
#pragma once

#include <cstdint>

namespace catoptric {

/// A 32-bit hash of `v` [Jarzynski2020, pcg].
inline std::uint32_t mixedBits(std::uint32_t v) {
  const std::uint32_t state = v * 747796405u + 2891336453u;
  const std::uint32_t word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
  return (word >> 22u) ^ word;
}

/// A number in [0, 1) from the upper 24 bits. It is exact in float, so it is never rounded up to 1.
inline float unitFloat(std::uint32_t bits) {
  return static_cast<float>(bits >> 8) * (1.0f / 16777216.0f);
}

}  // namespace catoptric
