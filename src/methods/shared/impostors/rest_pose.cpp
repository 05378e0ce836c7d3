#include "methods/shared/impostors/rest_pose.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "methods/shared/impostors/targets.h"
#include "scene/animate.h"

namespace catoptric::methods::impostors {
namespace {

/// Of a rigid motion's R^T R, the largest difference from 1. Ours: matrices of floats are off by
/// some 1e-6.
constexpr double kRigid = 1e-5;

/// Unless a scale is animated.
bool movesRigidly(const frame::ObjectRange& range) {
  return range.moving && !range.deforms;
}

}  // namespace

Mat3 axesOf(const frame::ObjectRange& range) {
  const Mat3 world(range.worldFromObject);
  return {normalizedOr(world[0], {1, 0, 0}), normalizedOr(world[1], {0, 1, 0}),
          normalizedOr(world[2], {0, 0, 1})};
}

Vec3 upBeside(const frame::ObjectRange& range, const Vec3& forward) {
  const Mat3 axes = axesOf(range);
  Vec3 best(0.0f);
  float least = 2.0f;
  for (int i : {1, 2, 0}) {
    const float along = std::abs(glm::dot(axes[i], forward));
    if (along < least - 0.2f) {
      least = along;
      best = axes[i];
    }
  }
  return best;
}

Camera cameraAlong(const frame::Geometry& geometry, int object, const Vec3& centroid,
                   const Vec3& forward) {
  const frame::ObjectRange& range = geometry.objects[static_cast<std::size_t>(object)];
  const float metres = std::max(geometry.bounds.diameter(), std::numeric_limits<float>::min());
  return lookAtPoints(verticesOf(geometry, object), centroid, forward, upBeside(range, forward),
                      kLeastSize * metres);
}

RestPose::RestPose(const scene::Scene& scene, double timeSeconds, const frame::Geometry& baked)
    : geometry_(frame::makeGeometry(scene, scene::poseAt(scene, timeSeconds))) {
  for (std::size_t i = 0; i < geometry_.attributes.size(); ++i)
    geometry_.attributes[i].bake = baked.attributes[i].bake;
}

bool RestPose::appliesTo(const frame::Geometry& geometry) {
  return std::ranges::any_of(geometry.objects, movesRigidly);
}

std::optional<Mat4> RestPose::motionTo(const frame::Geometry& geometry, int object) const {
  const auto o = static_cast<std::size_t>(object);
  const frame::ObjectRange& range = geometry.objects[o];
  if (!movesRigidly(range)) return std::nullopt;
  const glm::dmat4 motion = glm::dmat4(range.worldFromObject) *
                            glm::inverse(glm::dmat4(geometry_.objects[o].worldFromObject));
  const glm::dmat3 turn(motion);
  const glm::dmat3 product = glm::transpose(turn) * turn;
  double off = 0.0;
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) off = std::max(off, std::abs(product[i][k] - (i == k ? 1.0 : 0.0)));
  // A scale of 0 in either pose gives no number
  if (!(off <= kRigid) || !(glm::determinant(turn) > 0.0)) return std::nullopt;
  return Mat4(motion);
}

const Camera& RestPose::camera(int object, int direction, const Vec3& forward) {
  const auto [at, added] = cameras_.try_emplace({object, direction});
  if (added) {
    const frame::ObjectRange& range = geometry_.objects[static_cast<std::size_t>(object)];
    const Vec3 centroid = shapeOf(geometry_, object, geometry_.bounds.diameter()).centroid;
    at->second = cameraAlong(geometry_, object, centroid, glm::normalize(axesOf(range) * forward));
  }
  return at->second;
}

Camera moved(Camera camera, const Mat4& motion) {
  const Mat3 turn(motion);
  camera.eye = Vec3(motion * Vec4(camera.eye, 1.0f));
  camera.right = glm::normalize(turn * camera.right);
  camera.down = glm::normalize(turn * camera.down);
  camera.forward = glm::normalize(turn * camera.forward);
  return camera;
}

}  // namespace catoptric::methods::impostors
