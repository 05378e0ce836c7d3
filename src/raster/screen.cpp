#include "raster/screen.h"

#include <cmath>

namespace catoptric::raster {

Screen::Screen(const scene::Camera& camera, int width, int height)
    : all_{0, 0, width, height},
      size_(width, height),
      clipFromWorld_(glm::dmat4(scene::clipFromCamera(
                         camera, static_cast<float>(width) / static_cast<float>(height))) *
                     glm::dmat4(scene::cameraFromWorld(camera))),
      nearMetres_(camera.nearMetres) {}

Rectangle Screen::shows(std::span<const Vec3> points) const {
  glm::dvec2 low(std::numeric_limits<double>::infinity());
  glm::dvec2 high = -low;
  for (const Vec3& point : points) {
    const glm::dvec4 c = clipFromWorld_ * glm::dvec4(glm::dvec3(point), 1.0);
    if (!(c.w > nearMetres_)) return all_;
    const glm::dvec2 at = size_ * (0.5 + 0.5 * glm::dvec2(c.x, -c.y) / c.w);
    low = glm::min(low, at);
    high = glm::max(high, at);
  }
  if (!(low.x <= high.x)) return {};
  // Far outside, int would overflow
  low = glm::clamp(low, glm::dvec2(-1.0), size_ + 1.0);
  high = glm::clamp(high, glm::dvec2(-1.0), size_ + 1.0);
  return intersection(
      all_, {static_cast<int>(std::floor(low.x)) - 1, static_cast<int>(std::floor(low.y)) - 1,
             static_cast<int>(std::ceil(high.x)) + 1, static_cast<int>(std::ceil(high.y)) + 1});
}

}  // namespace catoptric::raster
