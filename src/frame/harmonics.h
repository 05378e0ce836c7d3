// The nine real spherical harmonics of order <= 2.
#pragma once

#include <array>

#include "core/vector_versions.h"

namespace catoptric::frame {

/// Their factors, in the order of shading.h.
inline constexpr std::array kHarmonics = {0.282095, 0.488603, 0.488603, 0.488603, 1.092548,
                                          1.092548, 0.315392, 1.092548, 0.546274};

template <class T>
CATOPTRIC_INLINE std::array<T, 9> sphericalHarmonics(T x, T y, T z) {
  return {T(kHarmonics[0]),
          T(kHarmonics[1]) * y,
          T(kHarmonics[2]) * z,
          T(kHarmonics[3]) * x,
          T(kHarmonics[4]) * x * y,
          T(kHarmonics[5]) * y * z,
          T(kHarmonics[6]) * (T(3) * z * z - T(1)),
          T(kHarmonics[7]) * x * z,
          T(kHarmonics[8]) * (x * x - y * y)};
}

}  // namespace catoptric::frame
