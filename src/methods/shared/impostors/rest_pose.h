// The cameras of images of whole objects, and the pose in which depth maps of rigidly moving
// objects are drawn. Such a map, and the rows made of it, stay valid while the object moves: their
// camera moves along [Popescu2006, Sec. 4.3].
#pragma once

#include <map>
#include <optional>
#include <utility>

#include "frame/geometry.h"
#include "methods/shared/impostors/camera.h"

namespace catoptric::methods::impostors {

/// Lengths below this share of the scene's diameter count as 0. Ours.
inline constexpr float kLeastSize = 1e-6f;

/// The axes of an object's frame in world space, unit length.
Mat3 axesOf(const frame::ObjectRange& range);
/// One of them, beside `forward`.
Vec3 upBeside(const frame::ObjectRange& range, const Vec3& forward);
/// The camera that looks along `forward` at an object with this centroid.
Camera cameraAlong(const frame::Geometry& geometry, int object, const Vec3& centroid,
                   const Vec3& forward);

/// The scene at one time, which is the same for all frames of a path: a map that is drawn in this
/// pose has the same bits in whichever frame it is drawn.
class RestPose {
 public:
  /// `baked`: the scene at any time, with the light that is baked.
  RestPose(const scene::Scene& scene, double timeSeconds, const frame::Geometry& baked);

  /// Whether any object moves and does not deform.
  static bool appliesTo(const frame::Geometry& geometry);

  const frame::Geometry& geometry() const { return geometry_; }
  /// The rotation and translation that take an object from here to its pose in `geometry`. nullopt:
  /// it never moves, or not rigidly.
  std::optional<Mat4> motionTo(const frame::Geometry& geometry, int object) const;
  /// The camera that looks along a direction in the object's frame. `direction` numbers the
  /// object's directions.
  const Camera& camera(int object, int direction, const Vec3& forward);

 private:
  frame::Geometry geometry_;
  std::map<std::pair<int, int>, Camera> cameras_;  ///< by object and direction
};

/// The camera after a rigid motion.
Camera moved(Camera camera, const Mat4& motion);

}  // namespace catoptric::methods::impostors
