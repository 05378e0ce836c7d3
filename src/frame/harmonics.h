// The nine real spherical harmonics of order <= 2.
#pragma once

#include <array>

#include "core/vector_versions.h"

namespace catoptric::frame {

/// In the order of shading.h.
template <class T>
CATOPTRIC_INLINE std::array<T, 9> sphericalHarmonics(T x, T y, T z) {
  return {T(0.282095),
          T(0.488603) * y,
          T(0.488603) * z,
          T(0.488603) * x,
          T(1.092548) * x * y,
          T(1.092548) * y * z,
          T(0.315392) * (T(3) * z * z - T(1)),
          T(1.092548) * x * z,
          T(0.546274) * (x * x - y * y)};
}

}  // namespace catoptric::frame
