#include "raster/rectangle.h"

#include <array>
#include <cmath>

#include "gl/api.h"

namespace catoptric::raster {

Rectangle shownRectangle(const scene::Camera& camera, int width, int height,
                         std::span<const Vec3> points) {
  const Rectangle all{0, 0, width, height};
  const auto size = glm::dvec2(width, height);
  const glm::dmat4 clip = glm::dmat4(scene::clipFromCamera(
                              camera, static_cast<float>(width) / static_cast<float>(height))) *
                          glm::dmat4(scene::cameraFromWorld(camera));
  glm::dvec2 low(std::numeric_limits<double>::infinity());
  glm::dvec2 high = -low;
  for (const Vec3& point : points) {
    const glm::dvec4 c = clip * glm::dvec4(glm::dvec3(point), 1.0);
    if (!(c.w > static_cast<double>(camera.nearMetres))) return all;
    const glm::dvec2 at = size * (0.5 + 0.5 * glm::dvec2(c.x, -c.y) / c.w);
    low = glm::min(low, at);
    high = glm::max(high, at);
  }
  if (!(low.x <= high.x)) return {};
  // Far outside, int would overflow
  low = glm::clamp(low, glm::dvec2(-1.0), size + 1.0);
  high = glm::clamp(high, glm::dvec2(-1.0), size + 1.0);
  return intersection(
      all, {static_cast<int>(std::floor(low.x)) - 1, static_cast<int>(std::floor(low.y)) - 1,
            static_cast<int>(std::ceil(high.x)) + 1, static_cast<int>(std::ceil(high.y)) + 1});
}

Rectangle shownRectangle(const scene::Camera& camera, int width, int height, const Box3& box) {
  if (box.empty()) return {};
  std::array<Vec3, 8> corners;
  for (std::size_t i = 0; i < corners.size(); ++i)
    corners[i] = Vec3((i & 1) != 0 ? box.max.x : box.min.x, (i & 2) != 0 ? box.max.y : box.min.y,
                      (i & 4) != 0 ? box.max.z : box.min.z);
  return shownRectangle(camera, width, height, corners);
}

ScissoredTo::ScissoredTo(const Rectangle& r) {
  glEnable(GL_SCISSOR_TEST);
  glScissor(r.x0, r.y0, r.width(), r.height());
}
ScissoredTo::~ScissoredTo() {
  glDisable(GL_SCISSOR_TEST);
}

}  // namespace catoptric::raster
