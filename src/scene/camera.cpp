#include "scene/camera.h"

#include <cmath>

namespace catoptric::scene {

Mat4 clipFromCamera(const Camera& camera, float aspect) {
  const float f = 1.0f / std::tan(0.5f * camera.verticalFovRad);
  Mat4 clip(0.0f);
  clip[0][0] = f / aspect;
  clip[1][1] = f;
  // Depth is near / distance: z' = near, w' = -z.
  clip[2][3] = -1.0f;
  clip[3][2] = camera.nearMetres;
  return clip;
}

Mat4 cameraFromWorld(const Camera& camera) {
  // The inverse of a rigid transform: transposed rotation, rotated translation.
  const Mat3 rotation = glm::transpose(Mat3(camera.worldFromCamera));
  Mat4 inverse(rotation);
  inverse[3] = Vec4(-(rotation * camera.eye()), 1.0f);
  return inverse;
}

Vec3 rayDirection(const Camera& camera, int width, int height, float x, float y) {
  const float halfHeight = std::tan(0.5f * camera.verticalFovRad);
  const float aspect = static_cast<float>(width) / static_cast<float>(height);
  const float cx = (2.0f * x / static_cast<float>(width) - 1.0f) * halfHeight * aspect;
  const float cy = (1.0f - 2.0f * y / static_cast<float>(height)) * halfHeight;
  return glm::normalize(Mat3(camera.worldFromCamera) * Vec3(cx, cy, -1.0f));
}

Mat3 rayFromPixel(const Camera& camera, int width, int height) {
  const float perPixel = 2.0f * std::tan(0.5f * camera.verticalFovRad) / static_cast<float>(height);
  const Vec3 right = Vec3(camera.worldFromCamera[0]) * perPixel;
  const Vec3 down = -Vec3(camera.worldFromCamera[1]) * perPixel;
  return Mat3(right, down,
              camera.forward() - 0.5f * static_cast<float>(width) * right -
                  0.5f * static_cast<float>(height) * down);
}

float pixelSpreadRad(const Camera& camera, int height) {
  return 2.0f * std::atan(std::tan(0.5f * camera.verticalFovRad) / static_cast<float>(height));
}

Camera lookAt(const Vec3& eye, const Vec3& target, const Vec3& up, float verticalFovRad) {
  const Vec3 back = normalizedOr(eye - target, Vec3(0.0f, 0.0f, 1.0f));
  Vec3 right = glm::cross(up, back);
  // Looking along `up`: any horizontal axis will do; take the one nearest to +x.
  if (glm::dot(right, right) < 1e-12f * std::max(1.0f, glm::dot(up, up))) {
    right =
        glm::cross(std::abs(back.z) < 0.9f ? Vec3(0.0f, 0.0f, 1.0f) : Vec3(0.0f, 1.0f, 0.0f), back);
    if (right.x < 0.0f) right = -right;
  }
  right = glm::normalize(right);
  Camera camera;
  camera.verticalFovRad = verticalFovRad;
  camera.worldFromCamera = Mat4(Vec4(right, 0.0f), Vec4(glm::cross(back, right), 0.0f),
                                Vec4(back, 0.0f), Vec4(eye, 1.0f));
  return camera;
}

}  // namespace catoptric::scene
