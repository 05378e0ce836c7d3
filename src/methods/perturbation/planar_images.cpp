// What planes alone show of an object: its mirror image.
#include <cmath>
#include <limits>

#include "methods/perturbation/virtual_objects.h"

namespace catoptric::methods::perturbation {

void mirroredTriangles(const frame::Geometry& geometry, int object,
                       std::span<const Plane<double>> planes, const glm::dvec3& eye,
                       TriangleCounts& counts, VirtualTriangles& result) {
  const frame::ObjectRange& range = geometry.objects[static_cast<std::size_t>(object)];
  result.object = object + 1;
  result.firstVertex = range.firstVertex;
  result.depthSlack = std::numeric_limits<float>::infinity();
  result.positions.clear();
  result.attributes.clear();
  result.images.clear();
  result.places.clear();
  result.indices.clear();
  for (std::uint32_t i = range.firstVertex; i < range.firstVertex + range.vertexCount; ++i) {
    const Vec3& p = geometry.positions[i];
    Vector<double> image{{p.x, p.y, p.z}};
    for (std::size_t plane = planes.size(); plane-- > 0;) image = mirrored(planes[plane], image);
    result.images.emplace_back(image[0], image[1], image[2], 1.0f);
  }
  if (planes.size() > 1) {
    // Whatever shows a vertex, it does as from the eye's mirror image
    Vector<double> seen{{eye.x, eye.y, eye.z}};
    for (const Plane<double>& plane : planes) seen = mirrored(plane, seen);
    result.places.assign(range.vertexCount, Vec3(seen[0], seen[1], seen[2]));
  }
  // What lies in the mirror that would show it is never seen there: its image, in the mirror too,
  // would be in front of the mirror's surface or behind it as rounding has it
  constexpr double kInPlane = 5e-7;  // of the coordinates: a few roundings of floats. Ours
  const Plane<double>& last = planes.back();
  const auto inPlane = [&](std::uint32_t vertex) {
    const Vec3& p = geometry.positions[vertex];
    const Vector<double> v{{p.x, p.y, p.z}};
    const double size = std::sqrt(dot(v, v)) + std::abs(last.offset);
    return std::abs(dot(last.normal, v) - last.offset) <= kInPlane * size;
  };
  for (std::uint32_t i = range.firstIndex; i < range.firstIndex + range.indexCount; i += 3) {
    const std::uint32_t* corner = &geometry.indices[i];
    if (inPlane(corner[0]) && inPlane(corner[1]) && inPlane(corner[2])) continue;
    for (int k = 0; k < 3; ++k) result.indices.push_back(corner[k] - range.firstVertex);
  }
  counts.vertices += range.vertexCount;
  counts.triangles += result.indices.size() / 3;
}

}  // namespace catoptric::methods::perturbation
