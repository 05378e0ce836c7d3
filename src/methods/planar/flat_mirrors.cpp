#include "methods/planar/flat_mirrors.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "raster/scene_gpu/materials.h"

namespace catoptric::methods::planar {
namespace {

/// Mirrors share a plane if their normals differ by at most this angle, and their places by at most
/// this share of the mirror's extent and coordinates. Ours: far below a sample.
constexpr double kSameAngleRad = 1e-5;
constexpr double kSamePlace = 1e-6;

/// The mean plane of an object's triangles; none if they have no area.
std::optional<Plane> planeOf(const frame::Geometry& geometry, const frame::ObjectRange& object) {
  glm::dvec3 sum(0.0);  // of normals, as long as twice the areas
  glm::dvec3 centre(0.0);
  double area = 0.0;
  for (std::uint32_t i = object.firstIndex; i < object.firstIndex + object.indexCount; i += 3) {
    const glm::dvec3 a(geometry.positions[geometry.indices[i]]);
    const glm::dvec3 b(geometry.positions[geometry.indices[i + 1]]);
    const glm::dvec3 c(geometry.positions[geometry.indices[i + 2]]);
    const glm::dvec3 normal = glm::cross(b - a, c - a);
    const double doubled = glm::length(normal);
    sum += glm::dot(sum, normal) < 0.0 ? -normal : normal;
    centre += doubled / 3.0 * (a + b + c);
    area += doubled;
  }
  if (!(glm::length(sum) > 0.0)) return std::nullopt;
  Plane plane;
  plane.normal = glm::normalize(sum);
  plane.distance = glm::dot(plane.normal, centre / area);
  return plane;
}

bool samePlane(const Plane& a, const Plane& b, const Box3& bounds) {
  if (glm::length(glm::cross(a.normal, b.normal)) > kSameAngleRad) return false;
  // At the other's place, since a small angle may move the plane far away
  const double largest =
      glm::length(glm::dvec3(glm::max(glm::abs(bounds.min), glm::abs(bounds.max))));
  return std::abs(a.above(bounds.centre())) <=
         kSamePlace * std::max<double>(bounds.diameter(), largest);
}

}  // namespace

bool isFlatMirror(const scene::Scene& scene, const scene::Object& object) {
  const scene::Material& material = scene.materials[object.material];
  return raster::objectClass(raster::materialClass(scene, material), object) ==
             raster::SampleClass::PlanarMirror &&
         !(material.refraction > 0.0f);
}

std::vector<FlatMirrors> findFlatMirrors(const scene::Scene& scene,
                                         const frame::Geometry& geometry) {
  std::vector<FlatMirrors> all;
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const frame::ObjectRange& object = geometry.objects[i];
    if (!isFlatMirror(scene, scene.objects[i])) continue;
    const std::optional<Plane> plane = planeOf(geometry, object);
    if (!plane) continue;
    auto found = std::ranges::find_if(all, [&](const FlatMirrors& mirrors) {
      return samePlane(mirrors.plane, *plane, object.bounds);
    });
    if (found == all.end()) found = all.insert(all.end(), {*plane, {}, {}});
    found->ids.push_back(static_cast<int>(i) + 1);
    found->bounds.extend(object.bounds);
  }
  return all;
}

View mirrored(const View& view, const Plane& plane) {
  glm::dmat4 mirror(1.0);
  for (int column = 0; column < 3; ++column)
    for (int row = 0; row < 3; ++row)
      mirror[column][row] -= 2.0 * plane.normal[row] * plane.normal[column];
  mirror[3] = glm::dvec4(2.0 * plane.distance * plane.normal, 1.0);
  const double side = glm::dot(plane.normal, view.eye) < plane.distance ? -1.0 : 1.0;
  View other;
  other.clipFromWorld = view.clipFromWorld * mirror;
  other.eye = glm::dvec3(mirror * glm::dvec4(view.eye, 1.0));
  other.clip = side * glm::dvec4(plane.normal, -plane.distance);
  return other;
}

bool isCut(const View& view, const Box3& box) {
  glm::dvec4 farthest(0.0, 0.0, 0.0, 1.0);  // corner
  for (int axis = 0; axis < 3; ++axis)
    farthest[axis] = view.clip[axis] > 0.0 ? box.max[axis] : box.min[axis];
  return !(glm::dot(view.clip, farthest) > 0.0);
}

Mat4 clipOfPart(const View& view, const raster::Rectangle& part, int width, int height) {
  // ndc of the part = scale * ndc of the frame + offset
  const glm::dvec2 scale(static_cast<double>(width) / part.width(),
                         static_cast<double>(height) / part.height());
  const glm::dvec2 offset(scale.x - 1.0 - 2.0 * part.x0 / part.width(),
                          1.0 - scale.y + 2.0 * part.y0 / part.height());
  glm::dmat4 rows = glm::transpose(view.clipFromWorld);
  rows[0] = scale.x * rows[0] + offset.x * rows[3];
  rows[1] = scale.y * rows[1] + offset.y * rows[3];
  return Mat4(glm::transpose(rows));
}

}  // namespace catoptric::methods::planar
