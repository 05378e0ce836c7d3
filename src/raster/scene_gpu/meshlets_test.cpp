// Levels of detail keep what their error says: borders, seams, the surface itself and its light.
#include "raster/scene_gpu/meshlets.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <iterator>
#include <span>
#include <vector>

#include "core/file.h"
#include "core/random.h"
#include "core/test_fields.h"
#include "frame/test_scenes.h"
#include "raster/scene_gpu/level_cache.h"
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

/// Light from everywhere, of radiance `ambient`.
frame::Lighting sky(float ambient) {
  frame::Lighting lighting;
  lighting.ambient = Vec3(ambient);
  return lighting;
}

/// Levels without error: flat sides can lose most of their triangles, and nothing else.
void expectKept(scene::Mesh mesh, double area) {
  test::SceneBuilder builder;
  builder.add(std::move(mesh), builder.diffuse(Vec3(0.5f)));
  const frame::Geometry geometry =
      frame::makeGeometry(builder.scene(), scene::poseAt(builder.scene(), 0.0));
  const std::vector<raster::LevelSource> sources(1);
  const raster::DetailLevels levels = raster::buildDetailLevels(geometry, sources, sky(0.0f));
  std::size_t exact = 0;
  for (const raster::DetailLevel& level : levels.levels) {
    if (level.error.metres > 1e-5f) break;
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
  const auto fewestWithout = [&](float ambient) {
    const raster::DetailLevels levels = raster::buildDetailLevels(geometry, sources, sky(ambient));
    std::size_t fewest = geometry.indices.size() / 3;
    for (const raster::DetailLevel& level : levels.levels) {
      if (level.error.metres > 1e-4f || level.error.steps > 0.01f) continue;
      std::size_t triangles = 0;
      for (std::uint32_t m = 0; m < level.meshletCount; ++m)
        triangles += levels.meshlets[level.firstMeshlet + m].indexCount / 3;
      fewest = std::min(fewest, triangles);
    }
    return fewest;
  };
  EXPECT_LT(fewestWithout(0.0f), 100u);
  EXPECT_GE(fewestWithout(1.0f), 2u * 40u);  // beside the edge, and on both sides of it
  EXPECT_LT(fewestWithout(1.0f), 40u * 40u);
}

/// What a vertex of a level shows, and where it is.
struct LevelVertices {
  const raster::DetailLevels& levels;
  const frame::Geometry& geometry;
  const frame::VertexAttributes& attributes(std::uint32_t i) const {
    const std::size_t own = geometry.vertexCount();
    return i < own ? geometry.attributes[i] : levels.attributes[i - own];
  }
  Vec3 position(std::uint32_t i) const {
    const std::size_t own = geometry.vertexCount();
    return geometry.positions[i < own ? i : levels.places[i - own]];
  }
};

TEST(DetailLevels, ShowTheMeanOfWhatTheyStandFor) {
  // Baked light that jumps from vertex to vertex, by 0.05 about 0.5: a vertex's own light is 0.05
  // off wherever the simplifier keeps it; one that stands for its surroundings shows their mean.
  test::SceneBuilder builder;
  builder.add(scene::makePlane({4.0f, 4.0f}, {60, 60}, scene::UvMode::Metres),
              builder.diffuse(Vec3(0.5f)));
  frame::Geometry geometry =
      frame::makeGeometry(builder.scene(), scene::poseAt(builder.scene(), 0.0));
  for (std::size_t i = 0; i < geometry.vertexCount(); ++i)
    geometry.attributes[i].bake =
        Vec4(Vec3(mixedBits(std::uint32_t(i) + 7919u) & 1 ? 0.55f : 0.45f), 0.0f);
  for (const bool moving : {false, true}) {
    const std::vector<raster::LevelSource> sources{{.moving = moving, .albedo = Vec3(0.5f)}};
    const raster::DetailLevels levels = raster::buildDetailLevels(geometry, sources, sky(0.0f));
    ASSERT_GE(levels.levels.size(), 3u);
    const raster::DetailLevel& level = levels.levels[levels.levels.size() - 1];
    const LevelVertices vertices{levels, geometry};
    double off = 0.0;
    double light = 0.0;
    double area = 0.0;
    for (std::uint32_t m = level.firstMeshlet; m < level.firstMeshlet + level.meshletCount; ++m) {
      const raster::Meshlet& meshlet = levels.meshlets[m];
      for (std::uint32_t i = 0; i < meshlet.indexCount; i += 3) {
        const std::uint32_t* t = &levels.indices[meshlet.firstIndex + i];
        const Vec3 a = vertices.position(t[0]);
        const double size =
            glm::length(glm::cross(vertices.position(t[1]) - a, vertices.position(t[2]) - a));
        for (int k = 0; k < 3; ++k) {
          light += size * vertices.attributes(t[k]).bake.x / 3.0;
          off += size * std::abs(vertices.attributes(t[k]).bake.x - 0.5) / 3.0;
        }
        area += size;
      }
    }
    EXPECT_EQ(levels.places.empty(), moving);
    // Texture coordinates in metres are linear over the plane: no vertex may be pulled from them
    for (std::size_t i = 0; i < levels.places.size(); ++i) {
      const Vec2 own = geometry.attributes[levels.places[i]].uv0;
      EXPECT_LT(glm::distance(levels.attributes[i].uv0, own), 1e-4f) << i;
    }
    if (moving) {
      EXPECT_NEAR(off / area, 0.05, 1e-4);
    } else {
      EXPECT_NEAR(light / area, 0.5, 0.005);
      EXPECT_LT(off / area, 0.04);
    }
  }
}

TEST(DetailLevels, AreExactWhereLightIsLinear) {
  test::SceneBuilder builder;
  builder.add(scene::makePlane({4.0f, 4.0f}, {40, 40}, scene::UvMode::Metres),
              builder.diffuse(Vec3(0.5f)));
  frame::Geometry geometry =
      frame::makeGeometry(builder.scene(), scene::poseAt(builder.scene(), 0.0));
  const auto linear = [](const Vec3& p) { return 1.0f + 0.2f * p.x - 0.1f * p.z; };
  for (std::size_t i = 0; i < geometry.vertexCount(); ++i)
    geometry.attributes[i].bake = Vec4(Vec3(linear(geometry.positions[i])), 0.0f);
  const std::vector<raster::LevelSource> sources{{.albedo = Vec3(0.5f)}};
  const raster::DetailLevels levels = raster::buildDetailLevels(geometry, sources, sky(0.0f));
  ASSERT_GE(levels.levels.size(), 3u);
  for (const raster::DetailLevel& level : levels.levels) EXPECT_LT(level.error.steps, 0.05f);
  for (std::size_t i = 0; i < levels.places.size(); ++i)
    EXPECT_NEAR(levels.attributes[i].bake.x, linear(geometry.positions[levels.places[i]]), 1e-3f);
}

bool sameLevels(const raster::DetailLevels& a, const raster::DetailLevels& b) {
  const auto same = [](const auto& x, const auto& y) {
    return std::ranges::equal(std::as_bytes(std::span(x)), std::as_bytes(std::span(y)));
  };
  return same(a.indices, b.indices) && same(a.meshlets, b.meshlets) && same(a.levels, b.levels) &&
         same(a.firstOfObject, b.firstOfObject) && same(a.places, b.places) &&
         same(a.attributes, b.attributes);
}

TEST(DetailLevels, AreTheSameFromTheCache) {
  const auto folder = std::filesystem::temp_directory_path() / "catoptric_levels_test";
  std::filesystem::remove_all(folder);
  test::SceneBuilder builder;
  builder.add(scene::makeSphere(1.0f, 64, 32, scene::UvMode::Metres), builder.diffuse(Vec3(0.5f)));
  builder.add(scene::makePlane({4.0f, 4.0f}, {20, 20}, scene::UvMode::Metres),
              builder.diffuse(Vec3(0.5f)));
  frame::Geometry geometry =
      frame::makeGeometry(builder.scene(), scene::poseAt(builder.scene(), 0.0));
  std::vector<raster::LevelSource> sources(2);
  const auto files = [&] { return std::distance(std::filesystem::directory_iterator(folder), {}); };
  const raster::DetailLevels made = raster::buildDetailLevels(geometry, sources, sky(1.0f));
  ASSERT_GT(made.levels.size(), 4u);
  // Not there, made and kept; read; damaged, made anew and kept whole again; read
  for (const bool damage : {false, false, true, false}) {
    if (damage) {
      const auto file = std::filesystem::directory_iterator(folder)->path();
      std::vector<std::byte> bytes = readFile(file);
      bytes[bytes.size() / 2] ^= std::byte{1};
      writeFileAtomically(file, bytes);
    }
    EXPECT_TRUE(sameLevels(made, raster::cachedDetailLevels(geometry, sources, sky(1.0f), folder)));
    EXPECT_EQ(files(), 1);
  }
  // Anything else that levels depend on makes another file.
  frame::Lighting lighting = sky(1.0f);
  auto& [type, position, direction, intensity, range, cosInner, cosOuter] =
      lighting.lights.emplace_back();
  auto& [whole, moving, textured, albedo] = sources[1];
  const auto print = [&] {
    raster::cachedDetailLevels(geometry, sources, lighting, folder);
    return files();
  };
  test::expectAllCount(print, whole, moving, textured, albedo, type, position, direction, intensity,
                       range, cosInner, cosOuter, lighting.ambient, geometry.positions[5],
                       geometry.attributes[5].bake, geometry.objects[0].uvPerMetre);
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace catoptric
