// Where an image shows points, for many of them.
#pragma once

#include <span>

#include "core/math.h"
#include "raster/regions/rectangle.h"
#include "scene/camera.h"

namespace catoptric::raster {

/// A camera's image of width x height.
class Screen {
 public:
  Screen(const scene::Camera& camera, int width, int height);
  /// As shownRectangle() in rectangle.h.
  Rectangle shows(std::span<const Vec3> points) const;

 private:
  Rectangle all_;
  glm::dvec2 size_;
  glm::dmat4 clipFromWorld_;
  glm::dmat4 terms_;  ///< sizes of the rounding errors of its terms on the device
  double nearMetres_;
};

}  // namespace catoptric::raster
