#include "trace/bake/surfaces.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "core/math.h"
#include "core/random.h"

namespace catoptric::trace {
namespace {

/// How far behind its own a surface lies, in offsets of its points; ours.
constexpr float kInset = 1.0f / 32.0f;
/// Normals of one place cancel out where the mean of their unit vectors is shorter than this; ours.
constexpr float kLeastMeanNormal = 0.25f;

struct PositionHash {
  std::size_t operator()(const Vec3& p) const {
    std::uint32_t h = 0;
    // Adding zero makes -0 and +0 one key, as they are equal.
    for (int k = 0; k < 3; ++k) h = mixedBits(h ^ std::bit_cast<std::uint32_t>(p[k] + 0.0f));
    return h;
  }
};

/// Sums over the vertices at one place, and over the triangles there.
struct Place {
  Vec3 normals{0.0f};
  Vec3 middles{0.0f};  ///< of triangles, from the place
  float depths = 0.0f;
  float vertices = 0.0f;
};

/// Per vertex a number, the same for all at one place.
std::vector<std::uint32_t> weldedPlaces(const frame::Geometry& geometry) {
  std::unordered_map<Vec3, std::uint32_t, PositionHash> numbers;
  numbers.reserve(geometry.vertexCount());
  std::vector<std::uint32_t> places(geometry.vertexCount());
  for (std::size_t v = 0; v < places.size(); ++v) {
    const auto number = static_cast<std::uint32_t>(numbers.size());
    places[v] = numbers.emplace(geometry.positions[v], number).first->second;
  }
  return places;
}

}  // namespace

frame::Geometry insetSurfaces(const frame::Geometry& geometry, const BakePoints& points) {
  const std::vector<std::uint32_t> places = weldedPlaces(geometry);
  std::vector<Place> sums(places.size());
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
