#include "raster/scene_gpu/detail_levels.h"

#include <meshoptimizer.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/parallel.h"

namespace catoptric::raster {
namespace {

/// Triangles of the smallest object that gets a coarser level, the step between levels, and how far
/// (as a share of the object's extent) a level may go. Ours, measured in the living room.
constexpr std::size_t kSmallestLevel = 32;
constexpr float kLevelRatio = 1.3f;
constexpr float kMaxLevelError = 0.25f;
/// Triangles lower than this part of their longest edge are lines (ours).
constexpr float kThinnest = 1e-5f;
/// Height of the relief that stands for a radiance of 1 while an object is simplified, as a share
/// of the scene's diameter. Ours, measured in the living room.
constexpr float kReliefShare = 0.03f;
/// Levels that show more are of no use to anyone. Ours, in display steps.
constexpr float kMostSteps = 16.0f;
/// Levels that show less with their vertices' own attributes need no others. Ours.
constexpr float kUnseenSteps = 0.05f;

/// One object's levels, with indices, meshlets and own vertices from 0.
struct ObjectLevels {
  ObjectMeshlets meshlets;
  std::vector<DetailLevel> levels;
  std::vector<std::uint32_t> places;
  std::vector<frame::VertexAttributes> attributes;
};

/// Whether a triangle is more than a line.
bool hasArea(const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 ab = b - a;
  const Vec3 ac = c - a;
  const Vec3 bc = c - b;
  const float longest2 = std::max({glm::dot(ab, ab), glm::dot(ac, ac), glm::dot(bc, bc)});
  return glm::length(glm::cross(ab, ac)) > kThinnest * longest2;
}

/// What an open surface gets from ambient light and environment, mean over its directions: the
/// largest component, W/m^2.
float skyIrradiance(const frame::Lighting& lighting) {
  Vec3 sky = kPi * lighting.ambient;
  constexpr float kConstantHarmonic = 0.282095f;
  if (lighting.environment) sky += kConstantHarmonic * lighting.environment->irradianceSh()[0];
  return std::max({sky.x, sky.y, sky.z});
}

/// Positions with baked light as if it were relief: flat walls are not uniformly lit, and vertices
/// are to be kept where their light bends.
std::vector<Vec3> reliefOf(const frame::Geometry& geometry, const frame::ObjectRange& range,
                           const LevelSource& source, float sky) {
  const float albedo = std::max({source.albedo.x, source.albedo.y, source.albedo.z});
  const float height = kReliefShare * geometry.bounds.diameter() / kPi * albedo;
  std::vector<Vec3> relief(range.vertexCount);
  for (std::uint32_t i = 0; i < range.vertexCount; ++i) {
    const frame::VertexAttributes& vertex = geometry.attributes[range.firstVertex + i];
    const float brightest =
        std::max({vertex.bake.x, vertex.bake.y, vertex.bake.z}) + vertex.bake.w * sky;
    relief[i] = geometry.positions[range.firstVertex + i] + vertex.normal * (height * brightest);
  }
  return relief;
}

/// Gives the indices that were added from `first` on vertices of their own.
void ownVertices(const frame::Geometry& geometry, const frame::ObjectRange& range,
                 const LevelFit& fit, std::size_t first, ObjectLevels& result) {
  constexpr std::uint32_t kNone = 0xFFFFFFFFu;
  std::vector<std::uint32_t> number(range.vertexCount, kNone);
  const auto base = static_cast<std::uint32_t>(geometry.vertexCount());
  for (std::size_t i = first; i < result.meshlets.indices.size(); ++i) {
    std::uint32_t& index = result.meshlets.indices[i];
    std::uint32_t& mine = number[index - range.firstVertex];
    if (mine == kNone) {
      mine = base + static_cast<std::uint32_t>(result.places.size());
      result.places.push_back(index);
      result.attributes.push_back(fit.attributes(index - range.firstVertex));
    }
    index = mine;
  }
}

ObjectLevels buildObjectLevels(const frame::Geometry& geometry, const frame::ObjectRange& range,
                               const LevelSource& source, const frame::Lighting& lighting) {
  ObjectLevels result;
  std::vector<std::uint32_t> indices = localIndices(geometry, range);
  if (indices.size() < 3 * kSmallestLevel) return result;
  const std::vector<Vec3> relief = reliefOf(geometry, range, source, skyIrradiance(lighting));
  LevelFit fit(geometry, range, source, lighting);
  std::vector<std::uint32_t> collapsed(indices.size());
  bool fitted = false;      // no coarser level needs less
  float simplified = 0.0f;  // metres, by the simplifier's own estimate, relief included
  const float scale = meshopt_simplifyScale(&relief.data()->x, range.vertexCount, sizeof(Vec3));
  while (indices.size() >= 3 * kSmallestLevel) {
    const std::size_t triangles = indices.size() / 3;
    const auto target = 3 * static_cast<std::size_t>(static_cast<float>(triangles) / kLevelRatio);
    float collapseError = 0.0f;
    const std::size_t count = meshopt_simplify(collapsed.data(), indices.data(), indices.size(),
                                               &relief.data()->x, range.vertexCount, sizeof(Vec3),
                                               target, kMaxLevelError, 0, &collapseError);
    if (count == 0 || 10 * count > 9 * indices.size()) break;
    // Where one without area lies at a border the next level's errors would not see its end
    indices.clear();
    for (std::size_t i = 0; i < count; i += 3) {
      const std::array<std::uint32_t, 3> triangle{collapsed[i], collapsed[i + 1], collapsed[i + 2]};
      if (hasArea(relief[triangle[0]], relief[triangle[1]], relief[triangle[2]]))
        indices.insert(indices.end(), triangle.begin(), triangle.end());
    }
    if (indices.empty()) break;
    fit.follow(indices);
    DetailLevel level;
    if (!fitted) level.error = fit.error();
    fitted = fitted || (!source.moving && level.error.steps > kUnseenSteps);
    if (fitted) {
      fit.fit();
      level.error = fit.error();
    }
    // Each level is made from the one before, by errors independent of its own
    simplified = std::hypot(simplified, collapseError * scale);
    level.error.metres = std::max(level.error.metres, simplified);
    if (level.error.steps > kMostSteps) break;
    const std::size_t first = result.meshlets.indices.size();
    level.firstMeshlet = static_cast<std::uint32_t>(result.meshlets.meshlets.size());
    appendMeshlets(geometry, range, indices, result.meshlets);
    level.meshletCount =
        static_cast<std::uint32_t>(result.meshlets.meshlets.size()) - level.firstMeshlet;
    if (fitted) ownVertices(geometry, range, fit, first, result);
    result.levels.push_back(level);
  }
  return result;
}

}  // namespace

DetailLevels buildDetailLevels(const frame::Geometry& geometry,
                               std::span<const LevelSource> sources,
                               const frame::Lighting& lighting) {
  std::vector<ObjectLevels> objects(geometry.objects.size());
  parallelFor(objects.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (!sources[i].whole)
        objects[i] = buildObjectLevels(geometry, geometry.objects[i], sources[i], lighting);
    }
  });

  DetailLevels result;
  result.firstOfObject.push_back(0);
  const auto shared = static_cast<std::uint32_t>(geometry.vertexCount());
  for (const ObjectLevels& object : objects) {
    const auto firstIndex = static_cast<std::uint32_t>(result.indices.size());
    const auto firstMeshlet = static_cast<std::uint32_t>(result.meshlets.size());
    const auto firstVertex = static_cast<std::uint32_t>(result.places.size());
    for (const std::uint32_t index : object.meshlets.indices)
      result.indices.push_back(index < shared ? index : index + firstVertex);
    for (Meshlet meshlet : object.meshlets.meshlets) {
      meshlet.firstIndex += firstIndex;
      result.meshlets.push_back(meshlet);
    }
    for (DetailLevel level : object.levels) {
      level.firstMeshlet += firstMeshlet;
      result.levels.push_back(level);
    }
    result.places.insert(result.places.end(), object.places.begin(), object.places.end());
    result.attributes.insert(result.attributes.end(), object.attributes.begin(),
                             object.attributes.end());
    result.firstOfObject.push_back(static_cast<std::uint32_t>(result.levels.size()));
  }
  return result;
}

}  // namespace catoptric::raster
