// Half floats as bits, in plain code that compilers turn into vector code. Values below the
// smallest normal half float become 0.
#pragma once

#include <bit>
#include <cstdint>

#include "core/vector_versions.h"

namespace catoptric::methods::impostors {

CATOPTRIC_INLINE float floatOf(std::uint16_t half) {
  const std::uint32_t exponentAndMore = (half & 0x7FFFu) << 13;
  const std::uint32_t sign = (half & 0x8000u) << 16;
  const std::uint32_t bits =
      exponentAndMore < (1u << 23) ? 0u : sign | (exponentAndMore + (112u << 23));
  return std::bit_cast<float>(bits);
}

/// Rounded to the nearest.
CATOPTRIC_INLINE std::uint16_t nearestHalf(float value) {
  const auto bits = std::bit_cast<std::uint32_t>(value);
  const std::uint32_t sized = (bits & 0x7FFFFFFFu) + 0x1000u;
  const std::uint32_t half = (sized - (112u << 23)) >> 13;
  return static_cast<std::uint16_t>(sized < (113u << 23) ? 0u : (bits >> 16 & 0x8000u) | half);
}

}  // namespace catoptric::methods::impostors
