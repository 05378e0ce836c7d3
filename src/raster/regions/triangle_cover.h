// Finds the samples of an image that triangles may cover, so that a part of the image can be drawn
// without the triangles that are not visible in it. On llvmpipe a triangle costs as much as the 4 x
// 4 blocks of samples that it touches.
#pragma once

#include <array>

#include "core/math.h"
#include "raster/regions/rectangle.h"
#include "scene/camera.h"

namespace catoptric::raster {

class TriangleCover {
 public:
  /// A vertex projected to the image.
  struct Corner {
    glm::dvec2 at{0.0};   ///< in samples
    double margin = 0.0;  ///< samples by which a driver may displace it
    bool seen = false;    ///< whether it lies beyond the near plane
  };

  /// For an image of width x height. Needs a current context.
  TriangleCover(const scene::Camera& camera, int width, int height);

  Corner corner(const Vec3& point) const;
  /// A rectangle that contains all samples whose centres the triangle may cover. The whole image if
  /// a corner is not `seen`.
  Rectangle covered(const std::array<Corner, 3>& corners) const;

 private:
  Rectangle all_;
  glm::dvec2 size_;
  std::array<glm::dvec4, 3> rows_;  ///< rows of clipFromWorld for clip x, y and w
  double nearMetres_;
  double snap_;  ///< samples by which a driver may displace a vertex
};

}  // namespace catoptric::raster
