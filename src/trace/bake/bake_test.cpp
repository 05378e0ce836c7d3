#include "trace/bake/bake.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>

#include "core/parallel.h"
#include "core/test_fields.h"
#include "frame/test_scenes.h"
#include "scene/animate.h"
#include "trace/bake/emitters.h"
#include "trace/bake/lattice.h"
#include "trace/bake/points.h"

namespace catoptric {
namespace {

using scene::BakeMode;
using test::rotation;
using test::SceneBuilder;
using test::translation;

frame::Geometry bake(const scene::Scene& scene, trace::BakeReport* report = nullptr,
                     const std::filesystem::path& cache = {}) {
  frame::Geometry geometry = frame::makeGeometry(scene, scene::poseAt(scene, 0.0));
  const frame::EnvironmentLight environment(scene.environment);
  const trace::BakeReport r = trace::bakeVertices(scene, geometry, environment, cache);
  if (report != nullptr) *report = r;
  return geometry;
}

/// The vertex of an object that is nearest to a place.
Vec4 bakeAt(const frame::Geometry& geometry, int object, const Vec3& place) {
  const frame::ObjectRange& range = geometry.objects[object];
  float best = std::numeric_limits<float>::infinity();
  Vec4 value(0.0f);
  for (std::uint32_t v = range.firstVertex; v < range.firstVertex + range.vertexCount; ++v) {
    const float d = glm::length(geometry.positions[v] - place);
    if (d < best) {
      best = d;
      value = geometry.attributes[v].bake;
    }
  }
  return value;
}

/// Horizontal 4 m x 4 m plane at y = 0, 33 x 33 vertices, with its front to +y.
scene::Mesh ground() {
  return scene::makePlane({4.0f, 4.0f}, {32, 32}, scene::UvMode::Unit);
}

TEST(BakePoints, LieOffTheirSurfaceByAFiftiethOfAnEdgeAtMostByAShareOfTheScene) {
  for (const int cells : {1, 1000}) {
    SceneBuilder builder;
    builder.add(scene::makePlane({4.0f, 4.0f}, {cells, 1}, scene::UvMode::Unit),
                builder.diffuse(Vec3(1.0f)));
    const frame::Geometry geometry =
        frame::makeGeometry(builder.scene(), scene::poseAt(builder.scene(), 0.0));
    const trace::BakePoints points = trace::makeBakePoints(geometry);
    const float largest = 2e-4f * geometry.bounds.diameter();
    for (std::size_t i = 0; i < points.size(); ++i) {
      float edges = 0.0f;
      for (const std::uint32_t n : points.neighboursOf(i))
        edges += glm::length(geometry.positions[n] - geometry.positions[i]);
      const float edge = edges / static_cast<float>(points.neighboursOf(i).size());
      EXPECT_NEAR(points.offsets[i], std::min(largest, 0.02f * edge), 1e-6f) << i;
      EXPECT_NEAR(points.positions[i].y, points.offsets[i], 1e-6f) << i;
      // Pulled into its triangles, by five times that at most
      const Vec3 pull = points.positions[i] - geometry.positions[i];
      EXPECT_LE(glm::length(Vec2(pull.x, pull.z)), 5.001f * points.offsets[i]) << i;
    }
  }
}

TEST(BakePoints, OfConsecutiveRanksAreCloseInSpace) {
  SceneBuilder builder;
  builder.add(scene::makePlane({63.0f, 63.0f}, {63, 63}, scene::UvMode::Unit),
              builder.diffuse(Vec3(1.0f)));
  const frame::Geometry geometry =
      frame::makeGeometry(builder.scene(), scene::poseAt(builder.scene(), 0.0));
  const trace::BakePoints points = trace::makeBakePoints(geometry);
  std::vector<int> pointOfRank(points.size(), -1);
  for (std::size_t i = 0; i < points.size(); ++i)
    pointOfRank.at(points.ranks[i]) = static_cast<int>(i);
  float apart = 0.0f;
  for (std::size_t rank = 0; rank < points.size(); ++rank) {
    ASSERT_GE(pointOfRank[rank], 0) << "two points have one rank";
    if (rank > 0)
      apart += glm::length(points.positions[pointOfRank[rank]] -
                           points.positions[pointOfRank[rank - 1]]);
  }
  EXPECT_LT(apart / static_cast<float>(points.size()), 2.0f);  // metres; of random ones: 33
}

TEST(BakePoints, TakeConsecutivePartsOfOneSequence) {
  const auto sorted = [](std::vector<Vec2> p, const Vec2& shift) {
    for (Vec2& q : p) q = trace::shifted(q, shift);
    std::ranges::sort(p, {}, [](const Vec2& q) { return q.x; });
    return p;
  };
  const std::vector<Vec2> later = sorted(trace::latticePoints(32, 7 * 32), Vec2(0.0f));
  const std::vector<Vec2> moved = sorted(trace::latticePoints(32), trace::sequenceShift(7 * 32));
  for (std::size_t k = 0; k < later.size(); ++k)
    EXPECT_LT(glm::length(later[k] - moved[k]), 1e-5f) << k;
}

TEST(BakeEmitters, ArePickedByPowerAndEvenlyOverEachOne) {
  // The second one has 1e-6 of the power, which fewer bits than a double has would not resolve.
  trace::Emitters emitters;
  emitters.triangles.resize(3);
  emitters.cumulative = {0.7, 0.700001, 1.0};
  const std::array<double, 4> bounds = {0.0, 0.7, 0.700001, 1.0};
  for (std::size_t t = 0; t < 3; ++t) {
    for (int k = 0; k < 100; ++k) {
      const double within = (k + 0.5) / 100.0;
      const auto pick = emitters.pick(bounds[t] + within * (bounds[t + 1] - bounds[t]));
      EXPECT_EQ(&pick.triangle, &emitters.triangles[t]);
      EXPECT_NEAR(pick.within, within, 1e-6) << t;
    }
  }
  EXPECT_EQ(&emitters.pick(0.0).triangle, emitters.triangles.data());
}

TEST(BakePoints, AreSmoothedByNoiseButNotNearSurfaces) {
  SceneBuilder builder;
  builder.add(ground(), builder.diffuse(Vec3(1.0f)));
  const frame::Geometry geometry =
      frame::makeGeometry(builder.scene(), scene::poseAt(builder.scene(), 0.0));
  const trace::BakePoints points = trace::makeBakePoints(geometry);
  // The root of the mean square of what is left of noise of 0.1 about 1.
  const auto left = [&](float noise, float nearness) {
    trace::ValueErrors errors(points.size());
    std::vector<Vec4> values(points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
      errors.noise[i] = noise;
      errors.nearness[i] = nearness;
      values[i] = Vec4(Vec3(1.0f + (points.ranks[i] * 7 % 3 == 0 ? 0.14f : -0.07f)), 0.0f);
    }
    trace::smoothValues(points, errors, values);
    double squares = 0.0;
    for (const Vec4& value : values)
      squares += (value.x - 1.0f) * (value.x - 1.0f) / static_cast<double>(points.size());
    return std::sqrt(squares);
  };
  EXPECT_NEAR(left(0.0f, 0.0f), 0.1, 0.005);
  EXPECT_LT(left(0.1f, 0.1f), 0.03);
  EXPECT_NEAR(left(0.1f, 20.0f), 0.1, 0.01);
}

TEST(BakeAmbientOcclusion, OpenPlaneIsFree) {
  SceneBuilder builder;
  builder.scene().bake.mode = BakeMode::AmbientOcclusion;
  builder.add(ground(), builder.diffuse(Vec3(1.0f)));
  const frame::Geometry geometry = bake(builder.scene());
  for (const frame::VertexAttributes& v : geometry.attributes) {
    EXPECT_EQ(v.bake, Vec4(0.0f, 0.0f, 0.0f, 1.0f));
  }
}

TEST(BakeAmbientOcclusion, WallsTakeHalfAndThreeQuarters) {
  // A wall in the plane x = 0 and one in z = 0, much larger than the distance of occlusion: next to
  // one wall half of the cosine-weighted hemisphere is free, next to both a quarter.
  SceneBuilder builder;
  builder.scene().bake.mode = BakeMode::AmbientOcclusion;
  builder.scene().bake.ambientOcclusionDistance = 100.0f;
  const int white = builder.diffuse(Vec3(1.0f));
  const int floor = builder.add(ground(), white, translation({2.0f, 0.0f, 2.0f}));
  scene::Mesh wall = scene::makePlane({2000.0f, 2000.0f}, {1, 1}, scene::UvMode::Unit);
  builder.add(wall, white, rotation(-90.0f, {0.0f, 0.0f, 1.0f}));
  builder.add(wall, white, rotation(90.0f, {1.0f, 0.0f, 0.0f}));
  const frame::Geometry geometry = bake(builder.scene());
  // Exactly in the corner, and 1/8 m away from the second wall, where it is seen at 0.35 degrees
  // above the horizon still: the free share of a point at distance d from an infinite wall is 1/2.
  EXPECT_NEAR(bakeAt(geometry, floor, {0.0f, 0.0f, 0.0f}).w, 0.25f, 0.02f);
  EXPECT_NEAR(bakeAt(geometry, floor, {2.0f, 0.0f, 0.0f}).w, 0.25f, 0.02f);
}

TEST(BakeAmbientOcclusion, HalfBesideOneWallAndLessFarther) {
  // A wall of height H seen from distance d takes (1 - d / sqrt(d^2 + H^2)) / 2.
  SceneBuilder builder;
  builder.scene().bake.mode = BakeMode::AmbientOcclusion;
  builder.scene().bake.ambientOcclusionDistance = 1e4f;
  builder.scene().bake.rays = 1024;
  const int white = builder.diffuse(Vec3(1.0f));
  const int floor = builder.add(ground(), white, translation({2.0f, 0.0f, 0.0f}));
  const float height = 1.0f;
  builder.add(scene::makePlane({2.0f * height, 2000.0f}, {1, 1}, scene::UvMode::Unit), white,
              rotation(-90.0f, {0.0f, 0.0f, 1.0f}));
  const frame::Geometry geometry = bake(builder.scene());
  EXPECT_NEAR(bakeAt(geometry, floor, {0.0f, 0.0f, 0.0f}).w, 0.5f, 0.01f);
  for (float d : {0.25f, 0.5f, 1.0f, 2.0f, 3.0f}) {
    const float taken = 0.5f * (1.0f - d / std::sqrt(d * d + height * height));
    EXPECT_NEAR(bakeAt(geometry, floor, {d, 0.0f, 0.0f}).w, 1.0f - taken, 0.01f) << d;
  }
}

TEST(BakeAmbientOcclusion, PointsInsideThingsTakeTheirNeighboursLight) {
  // A closed box stands on the floor and 0.2 m in it: what is inside does not darken its rim.
  SceneBuilder builder;
  builder.scene().bake.mode = BakeMode::AmbientOcclusion;
  builder.scene().bake.ambientOcclusionDistance = 0.5f;
  const int white = builder.diffuse(Vec3(1.0f));
  const int floor = builder.add(ground(), white);
  scene::BoxShape box;
  box.size = Vec3(1.1f, 0.4f, 1.1f);
  builder.add(scene::makeBox(box, scene::UvMode::Unit), white);
  trace::BakeReport report;
  const frame::Geometry geometry = bake(builder.scene(), &report);
  EXPECT_EQ(report.refused, 0u);
  EXPECT_GT(report.enclosed, 50u);
  EXPECT_GT(bakeAt(geometry, floor, {0.0f, 0.0f, 0.0f}).w, 0.4f);
  EXPECT_EQ(bakeAt(geometry, floor, {1.9f, 0.0f, 1.9f}).w, 1.0f);
}

TEST(BakeFull, PointLightFollowsInverseSquareAndCosine) {
  SceneBuilder builder;
  scene::Scene& scene = builder.scene();
  scene.bake.mode = BakeMode::Full;
  const int floor = builder.add(ground(), builder.diffuse(Vec3(0.0f)));
  scene::Light light;
  light.position = {0.0f, 2.0f, 0.0f};
  light.intensity = Vec3(8.0f, 4.0f, 2.0f);
  light.baked = true;
  scene.lights.push_back(light);
  const frame::Geometry geometry = bake(scene);
  for (float x : {0.0f, 0.5f, 1.0f, 1.75f}) {
    const float squared = x * x + 4.0f;
    const float expected = 8.0f * 2.0f / (squared * std::sqrt(squared));
    const Vec4 value = bakeAt(geometry, floor, {x, 0.0f, 0.0f});
    EXPECT_NEAR(value.x, expected, 0.02f * expected) << x;
    EXPECT_NEAR(value.y, 0.5f * expected, 0.01f * expected) << x;
    EXPECT_EQ(value.w, 0.0f);
  }
}

TEST(BakeFull, DiskLightHasItsFormFactor) {
  // Under the centre of a disk of radius r at height h: E = pi L r^2 / (r^2 + h^2).
  for (float r : {0.05f, 0.5f, 3.0f}) {
    SceneBuilder builder;
    scene::Scene& scene = builder.scene();
    scene.bake.mode = BakeMode::Full;
    const int floor = builder.add(scene::makePlane({4.0f, 4.0f}, {128, 128}, scene::UvMode::Unit),
                                  builder.diffuse(Vec3(0.0f)));
    builder.add(scene::makeDisk(r, 0.0f, 96, 8, scene::UvMode::Unit),
                builder.diffuse(Vec3(0.0f), Vec3(3.0f, 2.0f, 1.0f)),
                translation({0.0f, 1.0f, 0.0f}) * rotation(180.0f, {1.0f, 0.0f, 0.0f}));
    const frame::Geometry geometry = bake(scene);
    const float expected = kPi * 3.0f * r * r / (r * r + 1.0f);
    // Sixteen rays to the emitter and 256 around leave some noise,
    // smoothing takes a little of the peak.
    EXPECT_NEAR(bakeAt(geometry, floor, {0.0f, 0.0f, 0.0f}).x, expected, 0.05f * expected) << r;
  }
}

TEST(BakeFull, SmallBrightSurfacesLightAsEmittersDo) {
  // A disk above the floor that only a spot light below it lights. One of a thousand directions
  // meets it, yet each point of the floor has its light: E = albedo * E(disk) * the form factor.
  SceneBuilder builder;
  scene::Scene& scene = builder.scene();
  scene.bake.mode = BakeMode::Full;
  scene.bake.bounces = 1;
  scene.bake.rays = 64;
  const int floor = builder.add(ground(), builder.diffuse(Vec3(0.0f)));
  const float r = 0.04f;
  builder.add(scene::makeDisk(r, 0.0f, 96, 8, scene::UvMode::Unit), builder.diffuse(Vec3(0.5f)),
              translation({0.0f, 1.0f, 0.0f}) * rotation(180.0f, {1.0f, 0.0f, 0.0f}));
  scene::Light light;
  light.type = scene::LightType::Spot;
  light.position = {0.0f, 0.6f, 0.0f};
  light.direction = {0.0f, 1.0f, 0.0f};
  light.intensity = Vec3(10.0f);
  light.outerConeRad = radians(20.0f);
  light.innerConeRad = radians(19.0f);
  light.baked = true;
  scene.lights.push_back(light);
  const frame::Geometry geometry = bake(scene);
  const float onDisk = 10.0f / (0.4f * 0.4f);
  for (const float x : {0.25f, 0.5f, 1.0f, 1.5f}) {
    const float squared = 1.0f + x * x;
    const float expected = 0.5f * onDisk * r * r / (squared * squared);
    EXPECT_NEAR(bakeAt(geometry, floor, {x, 0.0f, 0.0f}).x, expected, 0.1f * expected) << x;
  }
}

TEST(BakeFull, SkyLightsAnOpenPlaneWithItsIrradiance) {
  SceneBuilder builder;
  scene::Scene& scene = builder.scene();
  scene.bake.mode = BakeMode::Full;
  builder.constantEnvironment(Vec3(0.5f, 1.0f, 2.0f));
  scene.ambient = Vec3(0.25f);
  const int floor = builder.add(ground(), builder.diffuse(Vec3(0.7f)));
  const frame::Geometry geometry = bake(scene);
  const Vec4 value = bakeAt(geometry, floor, {0.3f, 0.0f, 0.1f});
  EXPECT_NEAR(value.x, kPi * 0.75f, 1e-4f);
  EXPECT_NEAR(value.y, kPi * 1.25f, 1e-4f);
  EXPECT_NEAR(value.z, kPi * 2.25f, 1e-4f);
}

TEST(BakeFull, InterreflectionInAClosedSphereIsAGeometricSeries) {
  // Inside a diffuse sphere of albedo rho that emits L, every gather adds a power of rho:
  // E = pi L (1 + rho + ... + rho^(n - 1)) after n gathers.
  for (int bounces : {1, 2, 4}) {
    SceneBuilder builder;
    scene::Scene& scene = builder.scene();
    scene.bake.mode = BakeMode::Full;
    scene.bake.bounces = bounces;
    scene::Mesh sphere = scene::makeIcosphere(1.0f, 4, scene::UvMode::Unit);
    for (std::size_t i = 0; i + 2 < sphere.indices.size(); i += 3) {
      std::swap(sphere.indices[i + 1], sphere.indices[i + 2]);
    }
    for (Vec3& n : sphere.normals) n = -n;
    builder.add(sphere, builder.diffuse(Vec3(0.5f), Vec3(1.0f)));
    const frame::Geometry geometry = bake(scene);
    float expected = 0.0f;
    for (int i = 0; i < bounces; ++i) expected += kPi * std::pow(0.5f, static_cast<float>(i));
    double sum = 0.0;
    for (const frame::VertexAttributes& v : geometry.attributes) {
      sum += static_cast<double>(v.bake.x);
      EXPECT_NEAR(v.bake.x, expected, 0.08f * expected);
    }
    EXPECT_NEAR(sum / static_cast<double>(geometry.vertexCount()), expected, 0.01f * expected)
        << bounces;
  }
}

TEST(BakeFull, WhatTheSkyGivesCanStayApart) {
  // Shading adds it again: for the same normals the sum is what the whole bake holds.
  SceneBuilder builder;
  scene::Scene& scene = builder.scene();
  scene.bake.mode = BakeMode::Full;
  builder.constantEnvironment(Vec3(0.5f, 1.0f, 2.0f));
  const int white = builder.diffuse(Vec3(0.8f));
  builder.add(ground(), white);
  builder.add(scene::makeSphere(0.5f, 32, 16, scene::UvMode::Unit), white,
              translation({0.0f, 1.6f, 0.0f}));
  const frame::Geometry whole = bake(scene);
  scene.bake.skyApart = true;
  const frame::Geometry apart = bake(scene);
  const frame::EnvironmentLight environment(scene.environment);
  float least = 1.0f;
  for (std::size_t v = 0; v < whole.vertexCount(); ++v) {
    const Vec4& bake = apart.attributes[v].bake;
    least = std::min(least, bake.w);
    ASSERT_GE(std::min({bake.x, bake.y, bake.z}), 0.0f);
    const Vec3 sum = Vec3(bake) + bake.w * environment.irradiance(apart.attributes[v].normal);
    for (int c = 0; c < 3; ++c)
      ASSERT_NEAR(sum[c], whole.attributes[v].bake[c], 2e-3f * sum[c]) << v;
  }
  EXPECT_LT(least, 0.3f);  // below the sphere
  EXPECT_GT(bakeAt(apart, 0, {2.0f, 0.0f, 2.0f}).w, 0.95f);
}

TEST(BakeFull, LightDoesNotLeakThroughWalls) {
  // A closed room of single-sheet walls in bright sky, lit from nowhere: all of it stays dark, the
  // vertices in edges and corners too.
  SceneBuilder builder;
  scene::Scene& scene = builder.scene();
  scene.bake.mode = BakeMode::Full;
  builder.constantEnvironment(Vec3(1000.0f));
  scene::BoxShape box;
  box.size = Vec3(4.0f, 3.0f, 5.0f);
  box.segments = glm::ivec3(8);
  box.inward = true;
  builder.add(scene::makeBox(box, scene::UvMode::Unit), builder.diffuse(Vec3(0.8f)));
  const frame::Geometry geometry = bake(scene);
  for (const frame::VertexAttributes& v : geometry.attributes) {
    EXPECT_EQ(Vec3(v.bake), Vec3(0.0f));
  }
}

TEST(BakeFull, LightHardlyLeaksBetweenSheets) {
  // The same room of six planes, each an object of its own, which only meet at their borders.
  SceneBuilder builder;
  scene::Scene& scene = builder.scene();
  scene.bake.mode = BakeMode::Full;
  builder.constantEnvironment(Vec3(1000.0f));
  const int white = builder.diffuse(Vec3(0.8f));
  const scene::Mesh side = scene::makePlane({4.0f, 4.0f}, {16, 16}, scene::UvMode::Unit);
  const Mat4 below = translation({0.0f, -2.0f, 0.0f});
  for (const float angle : {0.0f, 90.0f, 180.0f, 270.0f})
    builder.add(side, white, rotation(angle, {1.0f, 0.0f, 0.0f}) * below);
  for (const float angle : {90.0f, 270.0f})
    builder.add(side, white, rotation(angle, {0.0f, 0.0f, 1.0f}) * below);
  const frame::Geometry geometry = bake(scene);
  double sum = 0.0;
  for (const frame::VertexAttributes& v : geometry.attributes) sum += v.bake.x;
  EXPECT_LT(sum / static_cast<double>(geometry.vertexCount()), 3e-5 * kPi * 1000.0);
}

TEST(BakeFull, ShadowOfARadiusIsSoft) {
  // A half plane at height 1 under a light of radius 0.2 at height 2: the penumbra on the floor is
  // 0.4 m wide, and in its middle half of the light is seen.
  SceneBuilder builder;
  scene::Scene& scene = builder.scene();
  scene.bake.mode = BakeMode::Full;
  const int black = builder.diffuse(Vec3(0.0f));
  const int floor = builder.add(ground(), black);
  builder.add(scene::makePlane({4.0f, 8.0f}, {1, 1}, scene::UvMode::Unit), black,
              translation({2.0f, 1.0f, 0.0f}));
  scene::Light light;
  light.position = {0.0f, 2.0f, 0.0f};
  light.intensity = Vec3(10.0f);
  light.radius = 0.2f;
  light.baked = true;
  scene.lights.push_back(light);
  const frame::Geometry geometry = bake(scene);
  const auto seen = [&](float x) {
    const float squared = x * x + 4.0f;
    return bakeAt(geometry, floor, {x, 0.0f, 0.0f}).x /
           (10.0f * 2.0f / (squared * std::sqrt(squared)));
  };
  EXPECT_NEAR(seen(-0.5f), 1.0f, 0.02f);
  EXPECT_NEAR(seen(0.0f), 0.5f, 0.1f);
  EXPECT_NEAR(seen(0.5f), 0.0f, 0.02f);
  EXPECT_GT(seen(-0.125f), 0.6f);
  EXPECT_LT(seen(-0.125f), 0.98f);
}

TEST(BakeFull, SpotLightsOfARadiusHaveAPenumbra) {
  // 2 m above the floor, to 30 degrees: the edge at 1.15 m is as wide as the light, 0.6 m.
  SceneBuilder builder;
  scene::Scene& scene = builder.scene();
  scene.bake.mode = BakeMode::Full;
  const int floor = builder.add(ground(), builder.diffuse(Vec3(0.0f)));
  scene::Light light;
  light.type = scene::LightType::Spot;
  light.position = {0.0f, 2.0f, 0.0f};
  light.intensity = Vec3(10.0f);
  light.outerConeRad = radians(30.0f);
  light.innerConeRad = radians(29.9f);
  light.radius = 0.3f;
  light.baked = true;
  scene.lights.push_back(light);
  const frame::Geometry geometry = bake(scene);
  const auto seen = [&](float x) {
    const float squared = x * x + 4.0f;
    return bakeAt(geometry, floor, {x, 0.0f, 0.0f}).x /
           (10.0f * 2.0f / (squared * std::sqrt(squared)));
  };
  EXPECT_NEAR(seen(0.75f), 1.0f, 0.02f);
  EXPECT_NEAR(seen(1.125f), 0.55f, 0.1f);
  EXPECT_NEAR(seen(1.25f), 0.3f, 0.1f);
  EXPECT_GT(seen(1.375f), 0.02f);
  EXPECT_EQ(seen(1.625f), 0.0f);
}

TEST(Bake, SameBitsForAnyThreadCountAndFromTheCache) {
  SceneBuilder builder;
  scene::Scene& scene = builder.scene();
  scene.bake.mode = BakeMode::Full;
  scene.bake.rays = 64;
  scene.fingerprint = 42;
  builder.constantEnvironment(Vec3(1.0f));
  builder.add(ground(), builder.diffuse(Vec3(0.7f)));
  builder.add(scene::makeSphere(0.5f, 32, 16, scene::UvMode::Unit), builder.diffuse(Vec3(0.4f)),
              translation({0.0f, 0.6f, 0.0f}));
  const auto same = [](const frame::Geometry& a, const frame::Geometry& b) {
    return std::memcmp(a.attributes.data(), b.attributes.data(),
                       a.attributes.size() * sizeof(frame::VertexAttributes)) == 0;
  };
  const std::filesystem::path cache =
      std::filesystem::path(::testing::TempDir()) / "catoptric_bake_test";
  std::filesystem::remove_all(cache);
  setThreadCount(1);
  const frame::Geometry one = bake(scene);
  setThreadCount(2);
  trace::BakeReport made;
  trace::BakeReport read;
  const frame::Geometry two = bake(scene, &made, cache);
  const frame::Geometry cached = bake(scene, &read, cache);
  setThreadCount(0);
  EXPECT_TRUE(same(one, two));
  EXPECT_TRUE(same(one, cached));
  EXPECT_FALSE(made.fromCache);
  EXPECT_TRUE(read.fromCache);

  // A damaged cache file is noticed, with a warning, and replaced.
  std::filesystem::path file;
  for (const auto& entry : std::filesystem::directory_iterator(cache)) file = entry.path();
  {
    std::fstream stream(file, std::ios::in | std::ios::out | std::ios::binary);
    stream.seekp(1000);
    stream.put('x');
  }
  trace::BakeReport again;
  ::testing::internal::CaptureStderr();
  const frame::Geometry repaired = bake(scene, &again, cache);
  EXPECT_THAT(::testing::internal::GetCapturedStderr(),
              ::testing::HasSubstr("is damaged: the light is baked again"));
  EXPECT_FALSE(again.fromCache);
  EXPECT_TRUE(same(one, repaired));

  // So is one that is cut short.
  std::filesystem::resize_file(file, 1000);
  trace::BakeReport cut;
  const frame::Geometry whole = bake(scene, &cut, cache);
  EXPECT_FALSE(cut.fromCache);
  EXPECT_TRUE(same(one, whole));

  // Other contents do not take it: they make another file.
  const auto files = [&] {
    bake(scene, nullptr, cache);
    return std::distance(std::filesystem::directory_iterator(cache), {});
  };
  auto& [mode, rays, bounces, ambientOcclusionDistance, skyApart] = scene.bake;
  test::expectAllCount(files, scene.fingerprint, rays, bounces, ambientOcclusionDistance, skyApart);
  mode = BakeMode::AmbientOcclusion;
  EXPECT_EQ(files(), 7);
  std::filesystem::remove_all(cache);
}

/// A box on the floor, with its sides and its bottom in planes of the floor's vertices, and a sheet
/// of two opposite faces above them.
scene::Scene& boxAndSheet(SceneBuilder& builder) {
  builder.scene().bake.mode = BakeMode::Full;
  builder.scene().bake.bounces = 2;
  builder.scene().bake.rays = 1024;
  builder.scene().environment.color = Vec3(1.0f);
  const int white = builder.diffuse(Vec3(0.8f));
  builder.add(ground(), white);
  scene::BoxShape box;
  box.size = Vec3(1.0f);
  builder.add(scene::makeBox(box, scene::UvMode::Unit), white, translation({0.0f, 0.5f, 0.0f}));
  scene::BoxShape sheet;
  sheet.size = Vec3(4.0f, 0.0f, 4.0f);
  sheet.segments = glm::ivec3(8, 1, 8);
  sheet.faces = {false, false, true, true, false, false};
  builder.add(scene::makeBox(sheet, scene::UvMode::Unit), white, translation({0.0f, 2.0f, 0.0f}));
  return builder.scene();
}

TEST(Bake, SurfacesThatCoincideAreMetFromOutside) {
  SceneBuilder builder;
  const scene::Scene& scene = boxAndSheet(builder);
  trace::BakeReport report;
  const frame::Geometry geometry = bake(scene, &report);
  // The floor's 7 x 7 vertices in the box are enclosed; the 32 at its foot are not, nor is anything
  // below the sheet.
  EXPECT_EQ(report.enclosed, 49u);
  // Away from the box's corners all points at its foot see the same half of the room.
  const float west = bakeAt(geometry, 0, {-0.5f, 0.0f, 0.0f}).x;
  const float north = bakeAt(geometry, 0, {0.0f, 0.0f, -0.5f}).x;
  EXPECT_NEAR(bakeAt(geometry, 0, {0.5f, 0.0f, 0.0f}).x, west, 0.05f * west);
  EXPECT_NEAR(bakeAt(geometry, 0, {0.0f, 0.0f, 0.5f}).x, north, 0.05f * north);
  EXPECT_NEAR(west, north, 0.05f * north);
}

TEST(Bake, IsTheSameByEveryInstructionSet) {
  SceneBuilder builder;
  const scene::Scene& scene = boxAndSheet(builder);
  const frame::Geometry expected = bake(scene);
  std::vector<const char*> sets;
  if (__builtin_cpu_supports("avx2")) sets.push_back("avx2");
  if (__builtin_cpu_supports("avx512vl")) sets.push_back("avx512");
  for (const char* set : sets) {
    ASSERT_EQ(setenv("CATOPTRIC_BAKE_ISA", set, 1), 0);
    const frame::Geometry geometry = bake(scene);
    unsetenv("CATOPTRIC_BAKE_ISA");
    for (std::size_t v = 0; v < geometry.vertexCount(); ++v) {
      const float value = expected.attributes[v].bake.x;
      ASSERT_NEAR(geometry.attributes[v].bake.x, value, 1e-4f * value) << set << ", vertex " << v;
    }
  }
}

TEST(Bake, MovingObjectsReceiveLightButCastNone) {
  SceneBuilder builder;
  scene::Scene& scene = builder.scene();
  scene.bake.mode = BakeMode::AmbientOcclusion;
  scene.bake.ambientOcclusionDistance = 10.0f;
  const int white = builder.diffuse(Vec3(1.0f));
  const int floor = builder.add(ground(), white);
  const int ball = builder.add(scene::makeSphere(0.5f, 32, 16, scene::UvMode::Unit), white,
                               translation({0.0f, 0.6f, 0.0f}));
  builder.move(ball, Vec3(1.0f, 0.0f, 0.0f), 1.0f);
  const frame::Geometry geometry = bake(scene);
  EXPECT_EQ(bakeAt(geometry, floor, {0.0f, 0.0f, 0.0f}).w, 1.0f);
  EXPECT_LT(bakeAt(geometry, ball, {0.0f, 0.1f, 0.0f}).w, 0.2f);
}

}  // namespace
}  // namespace catoptric
