#include "methods/glossy_lod/mesh_surface.h"

#include <algorithm>

namespace catoptric::methods::glossy_lod {
namespace {

/// Barycentrics of p1 and p2 where a place is projected onto a triangle's plane, moved into it.
Vec2 within(const Vec3& e1, const Vec3& e2, const Vec3& fromCorner, const TrianglePlace& place) {
  const Vec3 normal = glm::cross(e1, e2);
  const float square = glm::dot(normal, normal);
  if (!(square > 0.0f)) return {place.b1, place.b2};
  Vec2 at(glm::dot(glm::cross(fromCorner, e2), normal) / square,
          glm::dot(glm::cross(e1, fromCorner), normal) / square);
  if (!(isFinite(Vec3(at, 0.0f)))) return {place.b1, place.b2};
  at = glm::max(at, Vec2(0.0f));
  return at / std::max(at.x + at.y, 1.0f);
}

}  // namespace

MeshTriangle triangleUnder(const frame::Geometry& geometry, const SceneImages& images,
                           const QuadHit& found) {
  const Quad& quad = images.tree().quads()[found.node];
  const PlacedChart& chart = images.charts()[quad.chart];
  const glm::uvec2 texel = nearestTexel(chart, placeInChart(quad, chart, found.at));
  const TrianglePlace& place =
      chart.source->texels[chart.image.firstTexel + (texel.y << chart.image.texelLevel) + texel.x];
  const frame::ObjectRange& range = geometry.objects[static_cast<std::size_t>(chart.object)];
  const std::uint32_t* const v = &geometry.indices[range.firstIndex + 3 * place.triangle];
  const Vec3 p0 = geometry.positions[v[0]];
  return {p0, geometry.positions[v[1]] - p0, geometry.positions[v[2]] - p0, place};
}

Vec3 towardsSide(const frame::Geometry& geometry, const SceneImages& images, const QuadHit& found,
                 const Vec3& direction) {
  const MeshTriangle triangle = triangleUnder(geometry, images, found);
  const Vec3 normal = normalizedOr(glm::cross(triangle.e1, triangle.e2), Vec3(0.0f));
  const bool back = glm::dot(normal, direction) > 0.0f;
  return back == found.back ? direction : glm::reflect(direction, normal);
}

frame::SurfacePoint meshSurface(const Shading& shading, const QuadHit& found, const Vec3& position,
                                const Vec3& direction, float width, const Vec2& scatter) {
  const auto& [p0, e1, e2, place] = triangleUnder(*shading.geometry, *shading.images, found);
  const int object =
      shading.images->charts()[shading.images->tree().quads()[found.node].chart].object;
  const Vec2 at = within(e1, e2, position - p0, place);
  return frame::shadeSurface(*shading.scene, *shading.geometry, *shading.lighting, object,
                             place.triangle, at.x, at.y, p0 + at.x * e1 + at.y * e2, direction,
                             width, scatter);
}

}  // namespace catoptric::methods::glossy_lod
