// The camera of one impostor, and the position of a point in its image.
#pragma once

#include <array>
#include <span>

#include "core/math.h"

namespace catoptric::methods::impostors {

/// A pinhole camera: its rectangle on the plane at distance 1, and planes that bound its view.
struct Camera {
  Vec3 eye{0.0f};
  Vec3 right{1, 0, 0};  ///< right direction of the image, unit length, world space
  Vec3 down{0, -1, 0};
  Vec3 forward{0, 0, -1};
  Vec2 least{-1.0f};  ///< the rectangle's corner
  Vec2 size{2.0f};
  float nearMetres = 0.1f;
  float farMetres = 1.0f;
  float centreMetres = 0.5f;  ///< distance of the object's centroid, which a billboard contains

  bool operator==(const Camera&) const = default;

  /// Rows whose products with (p, 1) are u w, v w, g w and w. u and v are 0..1 in the image, from
  /// the upper left; the depth g is 1 at the near plane, 0 at the far plane, and linear in 1 / z.
  std::array<Vec4, 4> rows() const;
  /// For GL's clip space (reversed-Z, origin at the upper left), in which depth is g.
  Mat4 clipFromWorld() const;
};

/// The same camera without the margin around its points.
Camera withoutMargin(const Camera& camera);

/// A camera that looks along `forward` at `points`, from where a sphere around `centre` that
/// contains them fills 10 degrees [Popescu2006, Sec. 3]. `up`: any direction not parallel to
/// `forward`. Sizes of zero become `leastMetres`.
Camera lookAtPoints(std::span<const Vec3> points, const Vec3& centre, const Vec3& forward,
                    const Vec3& up, float leastMetres);

}  // namespace catoptric::methods::impostors
