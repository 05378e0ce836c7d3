#include "methods/reprojection/moving_boxes.h"

#include <algorithm>
#include <cmath>

namespace catoptric::methods::reprojection {
namespace {

/// Neighbours in a mesh's list mostly are neighbours in space (ours).
constexpr std::size_t kTrianglesPerBox = 256;

bool meets(const Box3& box, const Vec3& a, const Vec3& b) {
  float from = 0.0f;
  float to = 1.0f;
  for (int axis = 0; axis < 3; ++axis) {
    const float way = b[axis] - a[axis];
    if (way == 0.0f) {
      if (a[axis] < box.min[axis] || a[axis] > box.max[axis]) return false;
      continue;
    }
    const float first = (box.min[axis] - a[axis]) / way;
    const float second = (box.max[axis] - a[axis]) / way;
    from = std::max(from, std::min(first, second));
    to = std::min(to, std::max(first, second));
  }
  return from <= to;
}

}  // namespace

void MovingBoxes::update(const scene::Scene& scene, const frame::Geometry& geometry) {
  if (!made_) {
    for (std::size_t o = 0; o < geometry.objects.size(); ++o) {
      if (!geometry.objects[o].moving) continue;
      Object object;
      object.id = static_cast<std::uint32_t>(o + 1);
      if (!geometry.objects[o].deforms) {
        const scene::Mesh& mesh = scene.meshes[scene.objects[o].mesh];
        for (std::size_t i = 0; i < mesh.indices.size(); ++i) {
          if (i % (3 * kTrianglesPerBox) == 0) object.parts.emplace_back();
          object.parts.back().extend(mesh.positions[mesh.indices[i]]);
        }
        for (const Box3& part : object.parts) object.bounds.extend(part);
      }
      objects_.push_back(std::move(object));
    }
    made_ = true;
  }
  for (Object& object : objects_) {
    const frame::ObjectRange& range = geometry.objects[object.id - 1];
    object.there = !range.bounds.empty() && range.bounds.diameter() > 0.0f;
    if (range.deforms)
      object.bounds = range.bounds;
    else if (object.there)
      object.objectFromWorld = glm::inverse(range.worldFromObject);
  }
}

bool MovingBoxes::cross(const Vec3& a, const Vec3& b, std::uint32_t reflector,
                        std::uint32_t shown) const {
  return std::any_of(objects_.begin(), objects_.end(), [&](const Object& object) {
    if (!object.there || object.id == reflector || object.id == shown) return false;
    const Vec3 from(object.objectFromWorld * Vec4(a, 1.0f));
    const Vec3 to(object.objectFromWorld * Vec4(b, 1.0f));
    return meets(object.bounds, from, to) &&
           (object.parts.empty() ||
            std::any_of(object.parts.begin(), object.parts.end(),
                        [&](const Box3& part) { return meets(part, from, to); }));
  });
}

}  // namespace catoptric::methods::reprojection
