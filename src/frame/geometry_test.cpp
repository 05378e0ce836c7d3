#include "frame/geometry.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <limits>

#include "core/error.h"
#include "core/parallel.h"
#include "frame/test_scenes.h"
#include "scene/animate.h"
#include "scene/implicit/surface.h"

namespace catoptric::frame {
namespace {

using test::rotation;
using test::SceneBuilder;
using test::translation;

Geometry geometryOf(const scene::Scene& scene, double time = 0.0) {
  return makeGeometry(scene, scene::poseAt(scene, time));
}

TEST(Geometry, ObjectsAreContiguousAndShareOneArray) {
  SceneBuilder builder;
  const int grey = builder.diffuse(Vec3(0.5f));
  builder.add(scene::makePlane({1.0f, 1.0f}, {2, 3}, scene::UvMode::Unit), grey);
  builder.add(scene::makeSphere(1.0f, 16, 8, scene::UvMode::Unit), grey,
              translation({3.0f, 0.0f, 0.0f}));
  const Geometry g = geometryOf(builder.scene());
  ASSERT_EQ(g.objects.size(), 2u);
  EXPECT_EQ(g.objects[1].firstVertex, g.objects[0].vertexCount);
  EXPECT_EQ(g.objects[1].firstIndex, g.objects[0].indexCount);
  EXPECT_EQ(g.positions.size(), g.attributes.size() + 1);
  for (const ObjectRange& range : g.objects) {
    for (std::uint32_t i = 0; i < range.indexCount; ++i) {
      const std::uint32_t v = g.indices[range.firstIndex + i];
      EXPECT_GE(v, range.firstVertex);
      EXPECT_LT(v, range.firstVertex + range.vertexCount);
    }
  }
  EXPECT_NEAR(g.bounds.max.x, 4.0f, 1e-5f);
  EXPECT_NEAR(g.bounds.min.x, -0.5f, 1e-5f);
}

TEST(Geometry, WindingFollowsNormalsEvenMirrored) {
  SceneBuilder builder;
  const int grey = builder.diffuse(Vec3(0.5f));
  builder.add(
      scene::makeSphere(1.0f, 16, 8, scene::UvMode::Unit), grey,
      glm::scale(Mat4(1.0f), Vec3(-1.0f, 2.0f, 0.5f)) * rotation(20.0f, {1.0f, 1.0f, 0.0f}));
  // A model whose triangles disagree with its normals.
  scene::Mesh inside = scene::makeSphere(1.0f, 16, 8, scene::UvMode::Unit);
  for (std::size_t i = 0; i < inside.indices.size(); i += 3) {
    std::swap(inside.indices[i], inside.indices[i + 1]);
  }
  builder.add(inside, grey);
  const Geometry g = geometryOf(builder.scene());
  for (std::size_t i = 0; i < g.indices.size(); i += 3) {
    const Vec3 a = g.positions[g.indices[i]];
    const Vec3 across =
        glm::cross(g.positions[g.indices[i + 1]] - a, g.positions[g.indices[i + 2]] - a);
    if (glm::length(across) < 1e-6f) continue;  // at the poles
    EXPECT_GT(glm::dot(across, g.attributes[g.indices[i]].normal), 0.0f);
  }
}

TEST(Geometry, WhatHasNoAreaIsOnePoint) {
  for (const Vec3& scale : {Vec3(0.0f), Vec3(1, 0, 0), Vec3(0, 2, 0)}) {
    SceneBuilder builder;
    builder.add(scene::makeSphere(1.0f, 16, 8, scene::UvMode::Unit), builder.diffuse(Vec3(0.5f)),
                translation({3.0f, 1.0f, 2.0f}) * rotation(20.0f, {1.0f, 1.0f, 0.0f}) *
                    glm::scale(Mat4(1.0f), scale));
    const Geometry g = geometryOf(builder.scene());
    EXPECT_TRUE(vanished(g, 0));
    for (std::size_t v = 0; v < g.vertexCount(); ++v) EXPECT_EQ(g.positions[v], g.positions[0]);
  }
  SceneBuilder flat;
  flat.add(scene::makeSphere(1.0f, 16, 8, scene::UvMode::Unit), flat.diffuse(Vec3(0.5f)),
           glm::scale(Mat4(1.0f), Vec3(1, 0, 1)));
  EXPECT_FALSE(vanished(geometryOf(flat.scene()), 0));
}

TEST(Geometry, AFlattenedImplicitSurfaceKeepsTwoSides) {
  for (const Vec3& scale : {Vec3(1, 0, 1), Vec3(2, 3, 0), Vec3(-1, 1e-30f, 1), Vec3(1, 0.5f, 1)}) {
    SceneBuilder builder;
    builder.add(scene::makeImplicit(implicit::sphereSurface(1.0), 8, scene::UvMode::Unit),
                builder.diffuse(Vec3(0.5f)),
                translation({3.0f, 1.0f, 2.0f}) * rotation(20.0f, {1.0f, 1.0f, 0.0f}) *
                    glm::scale(Mat4(1.0f), scale));
    const Geometry g = geometryOf(builder.scene());
    EXPECT_FALSE(vanished(g, 0));
    const glm::dmat3 placed = glm::inverse(g.surfaces.at(0).surface.localFromWorld.linear);
    for (int i = 0; i < 3; ++i) {
      const bool flat = std::abs(scale[i]) < 0.5f;
      EXPECT_LT(glm::length(placed[i] - glm::dmat3(glm::dmat4(g.objects[0].worldFromObject))[i]),
                flat ? 3.1e-5 : 1e-6)
          << i;
      EXPECT_GT(glm::length(placed[i]), 0.99e-5) << i;
    }
  }
}

TEST(Geometry, UvPerMetreIsTheRootOfTheAreaRatio) {
  SceneBuilder builder;
  scene::Texture texture;
  texture.levels.push_back({1, 1, {255, 255, 255, 255}});
  builder.scene().textures.push_back(texture);
  const int textured = builder.diffuse(Vec3(1.0f));
  builder.scene().materials[textured].baseColorTexture.texture = 0;
  builder.add(scene::makePlane({4.0f, 4.0f}, {3, 5}, scene::UvMode::Unit), textured,
              glm::scale(Mat4(1.0f), Vec3(0.5f)));
  builder.add(scene::makePlane({4.0f, 4.0f}, {1, 1}, scene::UvMode::Unit),
              builder.diffuse(Vec3(1.0f)));
  const Geometry g = geometryOf(builder.scene());
  EXPECT_NEAR(g.objects[0].uvPerMetre, 0.5f, 1e-6f);
  EXPECT_EQ(g.objects[1].uvPerMetre, 0.0f);  // without textures nobody asks
}

TEST(Geometry, UpdateEqualsMakingItAnew) {
  SceneBuilder builder;
  const int grey = builder.diffuse(Vec3(0.5f));
  builder.add(scene::makePlane({1.0f, 1.0f}, {2, 3}, scene::UvMode::Unit), grey);
  builder.add(scene::makeSphere(1.0f, 64, 32, scene::UvMode::Unit), grey);
  builder.move(1, {0.0f, 1.0f, 0.5f}, 4.0f);
  scene::Texture texture;
  texture.levels.push_back({1, 1, {255, 255, 255, 255}});
  builder.scene().textures.push_back(texture);
  const int textured = builder.diffuse(Vec3(1.0f));
  builder.scene().materials[textured].baseColorTexture.texture = 0;
  builder.add(scene::makeImplicit(implicit::sphereSurface(1.0), 8, scene::UvMode::Unit), textured);
  builder.scaleUniformly(2, {{0.0f, 1.0f}, {4.0f, 3.0f}});
  const scene::Scene& scene = builder.scene();
  Geometry g = geometryOf(scene);
  EXPECT_FALSE(g.objects[0].moving);
  EXPECT_TRUE(g.objects[1].moving);
  g.attributes[g.objects[1].firstVertex].bake = Vec4(1.0f, 2.0f, 3.0f, 0.5f);
  setThreadCount(2);
  EXPECT_THAT(updateGeometry(g, scene, scene::poseAt(scene, 2.0)), ::testing::ElementsAre(1, 2));
  EXPECT_THAT(updateGeometry(g, scene, scene::poseAt(scene, 2.0)), ::testing::IsEmpty());
  setThreadCount(1);
  const Geometry fresh = geometryOf(scene, 2.0);
  setThreadCount(0);
  EXPECT_EQ(g.attributes[g.objects[1].firstVertex].bake, Vec4(1.0f, 2.0f, 3.0f, 0.5f));
  EXPECT_EQ(
      std::memcmp(g.positions.data(), fresh.positions.data(), g.positions.size() * sizeof(Vec3)),
      0);
  EXPECT_EQ(g.indices, fresh.indices);
  EXPECT_EQ(g.bounds.max, fresh.bounds.max);
  EXPECT_EQ(g.timeSeconds, 2.0);
  for (std::size_t o = 0; o < fresh.objects.size(); ++o) {
    EXPECT_EQ(g.objects[o].bounds.min, fresh.objects[o].bounds.min) << o;
    EXPECT_EQ(g.objects[o].bounds.max, fresh.objects[o].bounds.max) << o;
    EXPECT_EQ(g.objects[o].worldFromObject, fresh.objects[o].worldFromObject) << o;
    EXPECT_EQ(g.objects[o].uvPerMetre, fresh.objects[o].uvPerMetre) << o;
  }
  ASSERT_EQ(g.surfaces.size(), 1u);
  EXPECT_EQ(g.surfaces[0].object, 2);
  EXPECT_EQ(g.surfaces[0].reach, fresh.surfaces[0].reach);
}

TEST(Geometry, AFrameThatFailsStoresNothing) {
  SceneBuilder builder;
  const int grey = builder.diffuse(Vec3(0.5f));
  builder.add(scene::makePlane({1.0f, 1.0f}, {2, 3}, scene::UvMode::Unit), grey);
  builder.add(scene::makeImplicit(implicit::sphereSurface(1.0), 8, scene::UvMode::Unit), grey);
  builder.move(0, {0.0f, 1.0f, 0.5f}, 4.0f);
  builder.move(1, {0.0f, 1.0f, 0.5f}, 4.0f);
  const scene::Scene& scene = builder.scene();
  Geometry g = geometryOf(scene);
  const scene::Pose good = scene::poseAt(scene, 2.0);
  scene::Pose bad = good;
  Mat4& world = bad.worldFromNode[static_cast<std::size_t>(scene.objects[1].node)];
  world = glm::scale(world, Vec3(std::numeric_limits<float>::infinity()));
  EXPECT_THROW(updateGeometry(g, scene, bad), SceneError);
  EXPECT_EQ(g.timeSeconds, 0.0);
  // Both have moved since the last frame that succeeded
  EXPECT_THAT(updateGeometry(g, scene, good), ::testing::ElementsAre(0, 1));
}

TEST(Geometry, NonFinitePositionsAreAnErrorThatNamesTheObject) {
  SceneBuilder builder;
  builder.add(scene::makePlane({1.0f, 1.0f}, {1, 1}, scene::UvMode::Unit),
              builder.diffuse(Vec3(0.5f)),
              glm::scale(Mat4(1.0f), Vec3(3e38f)) * glm::scale(Mat4(1.0f), Vec3(1e20f)));
  try {
    geometryOf(builder.scene());
    FAIL();
  } catch (const SceneError& error) {
    EXPECT_THAT(error.what(), ::testing::HasSubstr("object0"));
  }
}

}  // namespace
}  // namespace catoptric::frame
