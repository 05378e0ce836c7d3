// An orthonormal basis about a direction.
#pragma once

#include <cmath>

#include "core/math.h"

namespace catoptric {

struct Basis {
  Vec3 x, y, z;
  /// Builds the basis about `normal`, which must have unit length. [Duff2017] Listing 3
  explicit Basis(const Vec3& normal) : z(normal) {
    const float sign = std::copysign(1.0f, z.z);
    const float a = -1.0f / (sign + z.z);
    const float b = z.x * z.y * a;
    x = Vec3(1.0f + sign * z.x * z.x * a, sign * b, -sign * z.x);
    y = Vec3(b, sign + z.y * z.y * a, -z.y);
  }
};

}  // namespace catoptric
