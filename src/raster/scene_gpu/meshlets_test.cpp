// Levels of detail keep what their error says: borders, seams, and the surface itself.
#include "raster/scene_gpu/meshlets.h"

#include <gtest/gtest.h>

#include "frame/test_scenes.h"
#include "scene/animate.h"
#include "scene/shapes/shapes.h"

namespace catoptric {
namespace {

/// Square metres of the triangles of a level, and the least cosine between their normals and those
/// of their vertices.
struct Surface {
  std::size_t triangles = 0;
  double area = 0.0;
  double leastCosine = 1.0;
};
Surface surfaceOf(const raster::DetailLevels& levels, const raster::DetailLevel& level,
                  const frame::Geometry& geometry) {
  Surface surface;
  for (std::uint32_t m = level.firstMeshlet; m < level.firstMeshlet + level.meshletCount; ++m) {
    const raster::Meshlet& meshlet = levels.meshlets[m];
    for (std::uint32_t i = 0; i < meshlet.indexCount; i += 3) {
      const std::uint32_t* corners = &levels.indices[meshlet.firstIndex + i];
      const auto at = [&](int k) { return glm::dvec3(geometry.positions[corners[k]]); };
      const glm::dvec3 normal = glm::cross(at(1) - at(0), at(2) - at(0));
      const double doubled = glm::length(normal);
      ++surface.triangles;
      surface.area += 0.5 * doubled;
      for (int k = 0; k < 3; ++k) {
        const glm::dvec3 own(geometry.attributes[corners[k]].normal);
        surface.leastCosine = std::min(surface.leastCosine, glm::dot(normal, own) / doubled);
      }
    }
  }
  return surface;
}

/// Levels without error: flat sides can lose most of their triangles, and nothing else.
void expectKept(scene::Mesh mesh, double area) {
  test::SceneBuilder builder;
  builder.add(std::move(mesh), builder.diffuse(Vec3(0.5f)));
  const frame::Geometry geometry =
      frame::makeGeometry(builder.scene(), scene::poseAt(builder.scene(), 0.0));
  const std::vector<raster::LevelSource> sources(1);
  const raster::DetailLevels levels = raster::buildDetailLevels(geometry, sources, 0.0f);
  std::size_t exact = 0;
  for (const raster::DetailLevel& level : levels.levels) {
    if (level.error > 1e-5f) break;
    ++exact;
    const Surface surface = surfaceOf(levels, level, geometry);
    SCOPED_TRACE(std::to_string(surface.triangles) + " triangles");
    EXPECT_NEAR(surface.area, area, 1e-4 * area);
    EXPECT_GT(surface.leastCosine, 0.9999);
  }
  EXPECT_GE(exact, 3u);
}

TEST(DetailLevels, KeepTheCornersOfAPlane) {
  expectKept(scene::makePlane({4.0f, 4.0f}, {20, 20}, scene::UvMode::Metres), 16.0);
}

TEST(DetailLevels, KeepTheNormalsOfABox) {
  scene::BoxShape box;
  box.size = Vec3(1.0f, 2.0f, 3.0f);
  box.segments = glm::ivec3(12);
  expectKept(scene::makeBox(box, scene::UvMode::Metres), 22.0);
}

TEST(DetailLevels, KeepTheEdgesOfAmbientOcclusion) {
  // Half of the plane sees no sky
  test::SceneBuilder builder;
  builder.add(scene::makePlane({4.0f, 4.0f}, {40, 40}, scene::UvMode::Metres),
              builder.diffuse(Vec3(0.5f)));
  frame::Geometry geometry =
      frame::makeGeometry(builder.scene(), scene::poseAt(builder.scene(), 0.0));
  for (std::size_t i = 0; i < geometry.positions.size(); ++i) {
    geometry.attributes[i].bake.w = geometry.positions[i].x > 0.01f ? 1.0f : 0.0f;
  }
  const std::vector<raster::LevelSource> sources(1);
  const auto fewestWithout = [&](float skyIrradiance) {
    const raster::DetailLevels levels = raster::buildDetailLevels(geometry, sources, skyIrradiance);
    std::size_t fewest = geometry.indices.size() / 3;
    for (const raster::DetailLevel& level : levels.levels) {
      if (level.error > 1e-4f) continue;
      fewest = std::min(fewest, surfaceOf(levels, level, geometry).triangles);
    }
    return fewest;
  };
  EXPECT_LT(fewestWithout(0.0f), 100u);
  EXPECT_GE(fewestWithout(3.0f), 2u * 40u);  // beside the edge, and on both sides of it
  EXPECT_LT(fewestWithout(3.0f), 40u * 40u);
}

}  // namespace
}  // namespace catoptric
