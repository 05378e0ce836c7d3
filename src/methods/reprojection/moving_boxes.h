// Where objects that move are now: what may have come between a sample and what it was seen to
// reflect.
#pragma once

#include <cstdint>
#include <vector>

#include "core/math.h"
#include "frame/geometry.h"
#include "scene/scene.h"

namespace catoptric::methods::reprojection {

/// Boxes of runs of triangles of the objects that move, each in its object's own space.
class MovingBoxes {
 public:
  /// For this moment; the boxes are made at the first call.
  void update(const scene::Scene& scene, const frame::Geometry& geometry);
  bool empty() const { return objects_.empty(); }
  /// Whether the way from a to b meets a box of another object than these two (ids).
  bool cross(const Vec3& a, const Vec3& b, std::uint32_t reflector, std::uint32_t shown) const;

 private:
  struct Object {
    std::uint32_t id = 0;
    Box3 bounds;
    std::vector<Box3> parts;  ///< of an object that deforms: none, and `bounds` in world space
    Mat4 objectFromWorld{1.0f};
    bool there = true;  ///< false: a scale of 0 leaves nothing of it
  };
  bool made_ = false;
  std::vector<Object> objects_;
};

}  // namespace catoptric::methods::reprojection
