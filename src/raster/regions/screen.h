// Where an image shows given points; faster than shownRectangle() for many calls.
#pragma once

#include <span>

#include "core/math.h"
#include "raster/regions/rectangle.h"
#include "scene/camera.h"

namespace catoptric::raster {

class Screen {
 public:
  Screen(const scene::Camera& camera, int width, int height);
  /// Of any view with reversed-Z, such as a mirrored one.
  Screen(const glm::dmat4& clipFromWorld, double nearMetres, int width, int height);
  /// See shownRectangle() in rectangle.h.
  Rectangle shows(std::span<const Vec3> points) const;
  Rectangle shows(const Box3& box) const;

 private:
  Rectangle all_;
  glm::dvec2 size_;
  glm::dmat4 clipFromWorld_;
  /// Bounds on the rounding errors on the GPU, for each entry of clipFromWorld_.
  glm::dmat4 terms_;
  double nearMetres_;
};

}  // namespace catoptric::raster
