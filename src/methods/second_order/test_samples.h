// Samples of simple surfaces, for tests that need no context.
#pragma once

#include <cmath>
#include <vector>

#include "methods/second_order/cameras/cluster_camera.h"
#include "methods/second_order/clustering/clusters.h"

namespace catoptric::methods::second_order {

constexpr int kSize = 96;  ///< samples of the frames along each side

inline scene::Camera cameraAt(const Vec3& eye, const Vec3& target) {
  return scene::lookAt(eye, target, Vec3(0.0f, 1.0f, 0.0f), radians(50.0f));
}

using Hit = bool(const Vec3& eye, const Vec3& direction, Vec3& position, Vec3& normal);

/// A G-buffer of one object, hit(origin, direction, position, normal) for each ray.
inline raster::GBufferCopy rasterized(const scene::Camera& camera, float roughness, Hit* hit) {
  raster::GBufferCopy copy;
  copy.width = copy.height = kSize;
  copy.samples = 1;
  const Mat3 rays = scene::rayFromPixel(camera, kSize, kSize);
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      const Vec3 ray =
          rays * Vec3(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f, 1.0f);
      Vec3 position(0.0f);
      Vec3 normal(0.0f);
      const bool found = hit(camera.eye(), glm::normalize(ray), position, normal);
      copy.object.push_back(found ? 1 : 0);
      const float along = glm::dot(position - camera.eye(), camera.forward());
      copy.depth.push_back(found ? camera.nearMetres / along : 0.0f);
      for (int k = 0; k < 3; ++k) copy.normal.push_back(normal[k]);
      copy.normal.push_back(roughness);
    }
  }
  return copy;
}

inline bool hitFloor(const Vec3& eye, const Vec3& d, Vec3& position, Vec3& normal) {
  if (d.y >= -0.02f) return false;
  position = eye - d * (eye.y / d.y);
  normal = Vec3(0.0f, 1.0f, 0.0f);
  return std::abs(position.x) < 2.0f && std::abs(position.z) < 2.0f;
}

inline bool hitSphere(const Vec3& eye, const Vec3& d, Vec3& position, Vec3& normal) {
  const float b = glm::dot(eye, d);
  const float c = glm::dot(eye, eye) - 1.0f;
  if (b * b - c < 0.0f) return false;
  position = eye + d * (-b - std::sqrt(b * b - c));
  normal = glm::normalize(position);
  return true;
}

inline CameraOptions roomAround(const scene::Camera& camera) {
  CameraOptions options;
  options.sceneBounds.min = Vec3(-5.0f, -2.0f, -5.0f) - camera.eye();
  options.sceneBounds.max = Vec3(5.0f, 4.0f, 5.0f) - camera.eye();
  return options;
}

inline Clustering clustersOf(const raster::GBufferCopy& gbuffer, const scene::Camera& camera,
                             ReflectorKind kind = ReflectorKind::Mirror) {
  Clustering clustering;
  const std::vector<ReflectorKind> kinds = {ReflectorKind::None, kind};
  clustering.build(gbuffer, camera, kinds, {});
  return clustering;
}

inline Vec3 projected(const ClusterCamera& camera, const Vec3& p) {
  const float w = glm::dot(camera.rowW, Vec4(p, 1.0f));
  return {glm::dot(camera.rowX, Vec4(p, 1.0f)) / w, glm::dot(camera.rowY, Vec4(p, 1.0f)) / w,
          glm::dot(camera.rowZ, Vec4(p, 1.0f)) / w};
}

/// Samples that the camera of their cluster does not show.
inline std::size_t samplesOutside(const Clustering& clustering,
                                  const std::vector<ClusterCamera>& cameras) {
  std::size_t outside = 0;
  for (const SampleBlock& block : clustering.blocks())
    for (const SampleRun& run : block.runs) {
      const ClusterCamera& made = cameras[block.slots[run.slot]];
      for (std::size_t i = run.first; i < run.first + run.count; ++i) {
        const Vec3 at = projected(made, block.position[i]);
        const bool inside = at.x > 0.0f && at.y > 0.0f && at.z > 0.0f &&
                            at.x < static_cast<float>(made.width) &&
                            at.y < static_cast<float>(made.height);
        outside += inside ? 0 : 1;
      }
    }
  return outside;
}

/// A sphere beside a floor: planar and curved clusters, in one object.
inline bool hitSphereOrFloor(const Vec3& eye, const Vec3& d, Vec3& position, Vec3& normal) {
  return hitSphere(eye, d, position, normal) || hitFloor(eye, d, position, normal);
}

}  // namespace catoptric::methods::second_order
