// Tests whether a moving object may have come between a sample and its reprojected hit.
#pragma once

#include <cstdint>
#include <vector>

#include "core/math.h"
#include "frame/geometry.h"
#include "scene/scene.h"

namespace catoptric::methods::reprojection {

/// Bounding boxes of runs of triangles of the moving objects, in object space.
class MovingBoxes {
 public:
  /// Updates to the geometry's time. The first call makes the boxes.
  void update(const scene::Scene& scene, const frame::Geometry& geometry);
  bool empty() const { return objects_.empty(); }
  /// Whether the segment from a to b intersects a box of an object other than these two (ids).
  bool cross(const Vec3& a, const Vec3& b, std::uint32_t reflector, std::uint32_t shown) const;

 private:
  struct Object {
    std::uint32_t id = 0;
    Box3 bounds;
    std::vector<Box3> parts;  ///< empty for a deforming object, whose `bounds` are in world space
    Mat4 objectFromWorld{1.0f};
    bool there = true;  ///< false: the object vanishes by a scale of 0
  };
  bool made_ = false;
  std::vector<Object> objects_;
};

}  // namespace catoptric::methods::reprojection
