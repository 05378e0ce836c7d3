#include "methods/shared/impostors/camera.h"

#include <algorithm>
#include <cmath>

namespace catoptric::methods::impostors {
namespace {

constexpr float kHalfFieldRad = radians(5.0f);  ///< the paper's 10 degrees
constexpr float kMargin = 0.01f;  ///< of the image and of the depth range, on each side; ours

}  // namespace

std::array<Vec4, 4> Camera::rows() const {
  const auto row = [&](const Vec3& axis) { return Vec4(axis, -glm::dot(axis, eye)); };
  const Vec4 x = row(right);
  const Vec4 y = row(down);
  const Vec4 z = row(forward);
  const Vec4 g = nearMetres / (farMetres - nearMetres) * (Vec4(0, 0, 0, farMetres) - z);
  return {(x - least.x * z) / size.x, (y - least.y * z) / size.y, g, z};
}

Mat4 Camera::clipFromWorld() const {
  const std::array<Vec4, 4> r = rows();
  return glm::transpose(Mat4(2.0f * r[0] - r[3], r[3] - 2.0f * r[1], r[2], r[3]));
}

Camera withoutMargin(const Camera& camera) {
  Camera tight = camera;
  tight.size = camera.size / (1.0f + 2.0f * kMargin);
  tight.least = camera.least + kMargin * tight.size;
  return tight;
}

Camera lookAtPoints(std::span<const Vec3> points, const Vec3& centre, const Vec3& forward,
                    const Vec3& up, float leastMetres) {
  Camera camera;
  camera.forward = forward;
  camera.right = glm::normalize(glm::cross(forward, up));
  camera.down = glm::cross(forward, camera.right);
  float radius2 = 0.0f;
  for (const Vec3& p : points) radius2 = std::max(radius2, glm::dot(p - centre, p - centre));
  const float radius = std::max(std::sqrt(radius2), leastMetres);
  camera.centreMetres = radius / std::sin(kHalfFieldRad);
  camera.eye = centre - camera.centreMetres * forward;
  Vec2 low(std::numeric_limits<float>::max());
  Vec2 high(-std::numeric_limits<float>::max());
  float nearest = std::numeric_limits<float>::max();
  float farthest = 0.0f;
  for (const Vec3& p : points) {
    const Vec3 q = p - camera.eye;
    const float z = glm::dot(q, forward);
    const Vec2 at = Vec2(glm::dot(q, camera.right), glm::dot(q, camera.down)) / z;
    low = glm::min(low, at);
    high = glm::max(high, at);
    nearest = std::min(nearest, z);
    farthest = std::max(farthest, z);
  }
  const Vec2 size = glm::max(high - low, Vec2(leastMetres / camera.centreMetres));
  camera.least = 0.5f * (low + high) - (0.5f + kMargin) * size;
  camera.size = (1.0f + 2.0f * kMargin) * size;
  const float depth = std::max(farthest - nearest, leastMetres);
  camera.nearMetres = 0.5f * (nearest + farthest) - (0.5f + kMargin) * depth;
  camera.farMetres = 0.5f * (nearest + farthest) + (0.5f + kMargin) * depth;
  return camera;
}

}  // namespace catoptric::methods::impostors
