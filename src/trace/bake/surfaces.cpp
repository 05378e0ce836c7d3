#include "trace/bake/surfaces.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "core/math.h"
#include "core/welding.h"

namespace catoptric::trace {
namespace {

/// How far behind its own a surface lies, in offsets of its points; ours.
constexpr float kInset = 1.0f / 32.0f;
/// Normals of one place cancel out where the mean of their unit vectors is shorter than this; ours.
constexpr float kLeastMeanNormal = 0.25f;

/// Sums over the vertices at one place, and over the triangles there.
struct Place {
  Vec3 normals{0.0f};
  Vec3 middles{0.0f};  ///< of triangles, from the place
  float depths = 0.0f;
  float vertices = 0.0f;
};

}  // namespace

frame::Geometry insetSurfaces(const frame::Geometry& geometry, const BakePoints& points) {
  Welding welding;
  welding.weld(geometry.vertexCount(),
               [&](std::size_t v) { return std::array{geometry.positions[v]}; });
  const std::vector<std::uint32_t>& places = welding.numbers;
  std::vector<Place> sums(welding.firsts.size());
  for (std::size_t v = 0; v < places.size(); ++v) {
    Place& place = sums[places[v]];
    place.normals += geometry.attributes[v].normal;
    place.depths += kInset * points.offsets[points.pointOfVertex[v]];
    place.vertices += 1.0f;
  }
  for (std::size_t i = 0; i + 2 < geometry.indices.size(); i += 3) {
    Vec3 middle(0.0f);
    for (std::size_t k = 0; k < 3; ++k)
      middle += geometry.positions[geometry.indices[i + k]] / 3.0f;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t v = geometry.indices[i + k];
      sums[places[v]].middles += middle - geometry.positions[v];
    }
  }

  frame::Geometry inset = geometry;
  for (frame::ObjectRange& object : inset.objects) {
    object.bounds = Box3{};
    for (std::uint32_t v = object.firstVertex; v < object.firstVertex + object.vertexCount; ++v) {
      Vec3& position = inset.positions[v];
      const Vec3& normal = geometry.attributes[v].normal;
      const Place& place = sums[places[v]];
      const float squared = glm::dot(place.normals, place.normals);
      const float depth = place.depths / place.vertices;
      if (squared < kLeastMeanNormal * kLeastMeanNormal * place.vertices * place.vertices) {
        position += normal * depth;  // a sheet of two faces
      } else if (glm::dot(place.normals, place.middles) > 0.0f) {
        position -= place.normals * (depth * place.vertices / squared);  // an inner corner
      } else {
        // Borders grow by twice as much: what they meet lies a little farther
        const Vec3 outward = normal * glm::dot(normal, place.middles) - place.middles;
        const float length = glm::length(outward);
        position +=
            outward * std::min(1.0f, 2.0f * depth / std::max(length, depth)) - normal * depth;
      }
      object.bounds.extend(position);
    }
  }
  return inset;
}

}  // namespace catoptric::trace
