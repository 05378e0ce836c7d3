#include "methods/second_order/cameras/frame.h"

#include <algorithm>
#include <cmath>

namespace catoptric::methods::second_order {
namespace {

constexpr float kWidestLobe = 1.0f;  ///< radians; lobes reach the frame's border beyond. Ours.
/// Lobes of a pixel's samples are shifted by so many steps (methods/traced).
constexpr int kShifts = 4;

Vec3 reflected(const Vec3& v, const Vec3& normal) {
  return v - 2.0f * glm::dot(v, normal) * normal;
}

/// Half the angle of the cone that a lobe's rays fill, radians: where the outermost of `rays`
/// samples points (trace::lobeDirection).
float lobeAngle(scene::Lobe lobe, int rays) {
  if (lobe.mirror()) return 0.0f;
  const float left = 0.5f / static_cast<float>(rays * kShifts);  // of the lobe, beyond
  if (lobe.ggx()) return 2.0f * std::atan(lobe.alpha() * std::sqrt(1.0f / left - 1.0f));
  const float n = scene::phongExponentFromRoughness(lobe.code);
  return std::acos(std::pow(left, 1.0f / (n + 1.0f)));
}

}  // namespace

ClusterFrame frameOf(const Cluster& cluster, const scene::Camera& camera, int rays) {
  ClusterFrame frame;
  const Vec3& n = cluster.meanNormal;
  // The frame's eye is the origin
  frame.mirroredEye = 2.0f * glm::dot(n, cluster.centroid) * n;
  const Vec3 toPlane = cluster.centroid - frame.mirroredEye;
  frame.eyeToPlane = glm::length(toPlane);
  frame.axis = normalizedOr(toPlane, n);
  const Vec3 mirroredRight = -reflected(Vec3(camera.worldFromCamera[0]), n);
  const Vec3 other =
      std::abs(frame.axis.y) < 0.9f ? Vec3(0.0f, 1.0f, 0.0f) : Vec3(1.0f, 0.0f, 0.0f);
  const Vec3 across = mirroredRight - glm::dot(mirroredRight, frame.axis) * frame.axis;
  frame.right =
      normalizedOr(glm::dot(across, across) > 1e-6f ? across : glm::cross(frame.axis, other),
                   Vec3(1.0f, 0.0f, 0.0f));
  frame.down = glm::cross(frame.axis, frame.right);
  for (std::size_t i = 0; i < kClipTilts.size(); ++i) {
    frame.tiltLength[i] = glm::length(cluster.planeNormal + kClipTilts[i] * frame.axis);
  }
  frame.lobe = std::min(lobeAngle(cluster.widestLobe, rays), kWidestLobe);
  return frame;
}

}  // namespace catoptric::methods::second_order
