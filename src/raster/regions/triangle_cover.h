// Which samples of an image triangles may cover, so that a part of it is drawn without those that
// show nothing there: on llvmpipe a triangle costs as much as the 4 x 4 samples that it touches.
#pragma once

#include <array>

#include "core/math.h"
#include "raster/regions/rectangle.h"
#include "scene/camera.h"

namespace catoptric::raster {

class TriangleCover {
 public:
  /// A vertex in the image.
  struct Corner {
    glm::dvec2 at{0.0};   ///< samples
    double margin = 0.0;  ///< by which a driver may put it elsewhere
    bool seen = false;    ///< beyond the near plane
  };

  /// Of an image of width x height. Needs a current context.
  TriangleCover(const scene::Camera& camera, int width, int height);

  Corner corner(const Vec3& point) const;
  /// Holds all samples whose centres the triangle may cover; all where a corner is not seen.
  Rectangle covered(const std::array<Corner, 3>& corners) const;

 private:
  Rectangle all_;
  glm::dvec2 size_;
  std::array<glm::dvec4, 3> rows_;  ///< of clip x, y and w
  double nearMetres_;
  double snap_;  ///< samples by which a driver may move a vertex
};

}  // namespace catoptric::raster
