#include "raster/regions/screen.h"

#include <array>
#include <cmath>

namespace catoptric::raster {

namespace {

/// The device transforms in float: each row's terms and sums, and the matrix's own products.
constexpr double kFloatRounding = 16.0 * 0x1p-24;

}  // namespace

Screen::Screen(const scene::Camera& camera, int width, int height)
    : Screen(glm::dmat4(scene::clipFromCamera(
                 camera, static_cast<float>(width) / static_cast<float>(height))) *
                 glm::dmat4(scene::cameraFromWorld(camera)),
             camera.nearMetres, width, height) {}

Screen::Screen(const glm::dmat4& clipFromWorld, double nearMetres, int width, int height)
    : all_{0, 0, width, height},
      size_(width, height),
      clipFromWorld_(clipFromWorld),
      nearMetres_(nearMetres) {
  for (int column = 0; column < 4; ++column)
    terms_[column] = kFloatRounding * glm::abs(clipFromWorld_[column]);
}

Rectangle Screen::shows(const Box3& box) const {
  if (box.empty()) return {};
  std::array<Vec3, 8> corners;
  for (std::size_t i = 0; i < corners.size(); ++i)
    corners[i] = Vec3((i & 1) != 0 ? box.max.x : box.min.x, (i & 2) != 0 ? box.max.y : box.min.y,
                      (i & 4) != 0 ? box.max.z : box.min.z);
  return shows(corners);
}

Rectangle Screen::shows(std::span<const Vec3> points) const {
  glm::dvec2 low(std::numeric_limits<double>::infinity());
  glm::dvec2 high = -low;
  for (const Vec3& point : points) {
    const glm::dvec4 c = clipFromWorld_ * glm::dvec4(glm::dvec3(point), 1.0);
    const glm::dvec4 rounding = terms_ * glm::dvec4(glm::abs(glm::dvec3(point)), 1.0);
    const double w = c.w - rounding.w;
    if (!(w > nearMetres_)) return all_;
    const glm::dvec2 seen = glm::dvec2(c.x, -c.y) / c.w;
    const glm::dvec2 slack = (glm::dvec2(rounding) + glm::abs(seen) * rounding.w) / w;
    low = glm::min(low, size_ * (0.5 + 0.5 * (seen - slack)));
    high = glm::max(high, size_ * (0.5 + 0.5 * (seen + slack)));
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
