// Projects points to pixels of the camera.
#pragma once

#include <initializer_list>
#include <limits>
#include <optional>

#include "core/math.h"
#include "methods/perturbation/reflector.h"
#include "scene/camera.h"

namespace catoptric::methods::perturbation {

/// Margin in pixels around the frame in which edges are still examined (not from the paper).
inline constexpr float kMargin = 8.0f;

class Projection {
 public:
  explicit Projection(const View& view)
      : size_(static_cast<float>(view.width), static_cast<float>(view.height)),
        clip_(glm::dmat4(scene::clipFromCamera(view.camera, size_.x / size_.y)) *
              glm::dmat4(scene::cameraFromWorld(view.camera))),
        eye_(view.camera.eye()),
        spread_(scene::pixelSpreadRad(view.camera, view.height)) {}

  const glm::dvec3& eye() const { return eye_; }
  float height() const { return size_.y; }
  double spread() const { return spread_; }

  std::optional<Vec2> operator()(const glm::dvec3& p) const {
    const glm::dvec4 c = clip_ * glm::dvec4(p, 1.0);
    if (!(c.w > 0.0)) return std::nullopt;
    return Vec2(glm::dvec2(0.5 + 0.5 * c.x / c.w, 0.5 - 0.5 * c.y / c.w) * glm::dvec2(size_));
  }
  /// Whether the bounding box of these points overlaps the frame.
  bool inFrame(std::initializer_list<Vec2> points) const {
    Vec2 low(std::numeric_limits<float>::infinity());
    Vec2 high = -low;
    for (const Vec2& p : points) {
      low = glm::min(low, p);
      high = glm::max(high, p);
    }
    return low.x < size_.x + kMargin && low.y < size_.y + kMargin && high.x > -kMargin &&
           high.y > -kMargin;
  }

 private:
  Vec2 size_;
  glm::dmat4 clip_;
  glm::dvec3 eye_;
  double spread_;  ///< angle of a pixel in radians
};

}  // namespace catoptric::methods::perturbation
