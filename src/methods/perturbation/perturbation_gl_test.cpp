// The method's frames against Embree's rays, and its virtual vertices against exact ones.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <span>

#include "methods/perturbation/reflector.h"
#include "methods/perturbation/test_comparison.h"
#include "methods/perturbation/virtual_draw.h"
#include "methods/perturbation/virtual_objects.h"

namespace catoptric::methods {
namespace {

TEST(Perturbation, ShowsWhatRaysSeeInASphere) {
  Comparison frame(stage(sphereMesh(0.7), test::translation({0.0f, 0.3f, 0.0f})).scene(), kFront);
  EXPECT_GT(frame.samples, 5000u);
  EXPECT_LT(frame.l1Of8Bit, 0.15);
  EXPECT_TRUE(frame.finite);
  EXPECT_GT(frame.output.counters["paths"], 60u);
  EXPECT_GT(frame.output.counters["triangles"], 100u);
  // Not everything is covered: the sky shows
  EXPECT_GT(frame.output.counters["environment"], 100u);
  EXPECT_LT(frame.output.counters["environment"], frame.samples);
}

TEST(Perturbation, ShowsWhatRaysSeeInAPlane) {
  test::SceneBuilder builder =
      stage(scene::makePlane({3.0f, 2.0f}, {1, 1}, scene::UvMode::Metres),
            test::translation({0.0f, 0.5f, -0.5f}) * test::rotation(90.0f, {1.0f, 0.0f, 0.0f}));
  Comparison frame(builder.scene(), kFront);
  EXPECT_GT(frame.samples, 5000u);
  EXPECT_LT(frame.l1Of8Bit, 0.05);
  EXPECT_EQ(frame.output.counters["retraced"], 0u);
}

TEST(Perturbation, PlansTheMemoryOfWhatPlanesShow) {
  using namespace perturbation;
  test::SceneBuilder builder =
      stage(scene::makePlane({3.0f, 2.0f}, {1, 1}, scene::UvMode::Metres),
            test::translation({0.0f, 0.5f, -0.5f}) * test::rotation(90.0f, {1.0f, 0.0f, 0.0f}));
  test::GlStage world(builder.scene(), test::framesOf(64, 48, 1));
  const Plane<double> mirror{{{0.0, 0.0, 1.0}}, -0.5};
  const std::vector<Plane<double>> planes{mirror, {{{1.0, 0.0, 0.0}}, -2.0}};
  std::uint64_t vertices = 0;
  std::uint64_t triangles = 0;
  for (int o = 0; o < static_cast<int>(world.scene.objects.size()); ++o) {
    const frame::ObjectRange& range = world.moment.geometry.objects[static_cast<std::size_t>(o)];
    vertices += range.vertexCount;
    triangles += range.indexCount / 3;
    for (const std::size_t count : {1u, 2u}) {
      VirtualTriangles shown;
      TriangleCounts counts;
      mirroredTriangles(world.moment.geometry, o, std::span(planes).first(count),
                        glm::dvec3(kFront.eye()), counts, shown);
      const VirtualObject drawn(shown, world.raster.scene(), kFront, 64, 48);
      EXPECT_EQ(drawn.bytes(), kObjectBytes + range.vertexCount * planarVertexBytes(count) +
                                   drawn.triangles.size() * kTriangleBytes);
    }
  }
  const MethodPlan plan = perturbationEntry()
                              .make(config::parseText("{}", "options"))
                              ->plan(world.scene, world.settings);
  const auto item = std::ranges::find(plan.items, "virtual objects", &PlanItem::name);
  ASSERT_NE(item, plan.items.end());
  EXPECT_EQ(item->bytes, world.scene.objects.size() * kObjectBytes +
                             vertices * planarVertexBytes(1) + triangles * kTriangleBytes);
}

TEST(Perturbation, ShowsReflectionsInReflectionsOfTwoSpheres) {
  const auto scene = [] {
    return twoMirrors(sphereMesh(0.45, 12), test::translation({0.6f, 0.0f, 0.3f})).scene();
  };
  Comparison one(scene(), kFront);
  EXPECT_EQ(one.output.counters["path_types"], 2u);
  Comparison two(scene(), kFront, R"({"bounces": 2})", {.bounces = 2});
  // Outlines within outlines: a little more than what one bounce misses
  EXPECT_LT(one.l1Of8Bit, 0.5);
  EXPECT_LT(two.l1Of8Bit, one.l1Of8Bit + 0.1);
  EXPECT_TRUE(two.finite);
  // Spheres do not show themselves: A, B, A in B, B in A
  EXPECT_EQ(two.output.counters["path_types"], 4u);
  EXPECT_NE(one.reflection, two.reflection);
  // Where they differ the other order's frame is far off
  Comparison wrong(scene(), kFront, R"({"bounces": 1})", {.bounces = 2});
  EXPECT_GT(wrong.l1Of8Bit, 2.0 * two.l1Of8Bit);
  Comparison three(scene(), kFront, R"({"bounces": 3})", {.bounces = 3, .fresnelSchlick = true});
  EXPECT_LT(three.l1Of8Bit, one.l1Of8Bit + 0.1);
  EXPECT_GT(three.output.counters["path_types"], 4u);
}

TEST(Perturbation, FindsReflectorsThatAreSmallInOthers) {
  // A ball whose image in the other one is a pixel wide, before a floor that they show too
  const auto scene = [] {
    return twoMirrors(sphereMesh(0.06, 12), test::translation({0.4f, 0.1f, 0.5f})).scene();
  };
  Comparison frame(scene(), kFront, R"({"bounces": 2})", {.bounces = 2});
  EXPECT_EQ(frame.output.counters["path_types"], 4u);
  EXPECT_EQ(frame.output.counters["path_types_missed"], 0u);
  EXPECT_EQ(frame.output.counters["path_types_left_out"], 0u);

  // The first of them alone: both mirrors, but nothing in the second or in each other
  Comparison few(scene(), kFront, R"({"bounces": 2})", {.bounces = 2}, false, 2);
  EXPECT_EQ(few.output.counters["path_types"], 2u);
  EXPECT_EQ(few.output.counters["path_types_left_out"], 4u);
  EXPECT_GT(few.l1Of8Bit, frame.l1Of8Bit);
  Comparison one(scene(), kFront, R"({"bounces": 1})", {.bounces = 2});
  EXPECT_EQ(few.reflection, one.reflection);
}

TEST(Perturbation, ShowsReflectionsInReflectionsOfASphereAndAPlane) {
  Comparison frame(twoMirrors(scene::makePlane({3.0f, 2.0f}, {1, 1}, scene::UvMode::Metres),
                              uprightAt({0.0f, 0.5f, -1.0f}))
                       .scene(),
                   kFront, R"({"bounces": 2})", {.bounces = 2});
  EXPECT_LT(frame.l1Of8Bit, 0.3);
  EXPECT_EQ(frame.output.counters["path_types"], 4u);
}

TEST(Perturbation, ShowsPlanesInPlanesExactly) {
  // A corner: the eye sees itself turned round by two bounces, and each wall in the other
  test::SceneBuilder builder = stage(scene::makePlane({3.0f, 2.0f}, {1, 1}, scene::UvMode::Metres),
                                     uprightAt({0.0f, 0.5f, -1.0f}));
  builder.add(scene::makePlane({3.0f, 2.0f}, {1, 1}, scene::UvMode::Metres),
              builder.reflective(1.0f),
              test::rotation(90.0f, {0.0f, 1.0f, 0.0f}) * uprightAt({0.0f, 0.5f, -1.5f}));
  Comparison frame(builder.scene(), kFront, R"({"bounces": 2})", {.bounces = 2});
  EXPECT_LT(frame.l1Of8Bit, 0.05);
  EXPECT_EQ(frame.output.counters["path_types"], 4u);
  EXPECT_EQ(frame.output.counters["retraced"], 0u);
}

TEST(Perturbation, MirrorsInOnePlaneDoNotShowEachOther) {
  // Side by side and overlapping, turned so that their vertices are rounded; 2 m beside the origin
  const auto l1 = [](float behind, int bounces) {
    const Mat4 turn = test::rotation(17.0f, {0.2f, 1.0f, 0.1f});
    const auto mirror = [] {
      return scene::makePlane({1.2f, 1.4f}, {4, 4}, scene::UvMode::Metres);
    };
    test::SceneBuilder builder = stage(mirror(), turn * uprightAt({-0.5f, 0.4f, -0.5f}));
    builder.add(mirror(), builder.reflective(0.9f), turn * uprightAt({0.5f, 0.5f, -0.5f - behind}));
    Comparison frame(builder.scene(), kFront, R"({"bounces": )" + std::to_string(bounces) + "}",
                     {.bounces = bounces});
    return frame.l1Of8Bit;
  };
  for (const int bounces : {1, 2})
    EXPECT_LT(l1(0.0f, bounces), l1(0.01f, bounces) + 0.2) << bounces;
}

TEST(Perturbation, ShowsWhatRaysSeeThroughALens) {
  test::SceneBuilder builder;
  const int glass = builder.reflective(1.0f);
  builder.scene().materials[glass].refraction = 1.25f;
  builder.add(
      scene::makeImplicit(implicit::ellipsoidSurface({0.6, 0.6, 0.12}), 16, scene::UvMode::Metres),
      glass, test::translation({0.2f, 0.3f, 1.0f}) * test::rotation(15.0f, {0, 1, 0}));
  const auto box = [&](const Vec3& centre, const Vec3& size, const Vec3& color) {
    builder.add(scene::makeBox({.size = size}, scene::UvMode::Metres), builder.diffuse(color),
                test::translation(centre));
  };
  // Nearer than the focus, 6 m behind it
  box({0.35f, 0.2f, 0.4f}, {0.3f, 0.5f, 0.3f}, {0.9f, 0.1f, 0.2f});
  box({0.0f, 0.4f, 0.2f}, {0.3f, 0.9f, 0.3f}, {0.1f, 0.3f, 0.9f});
  builder.constantEnvironment(Vec3(0.8f, 0.9f, 1.0f));
  Comparison frame(builder.scene(), kFront, R"({"bounces": 2, "tessellation_error": 2})",
                   {.bounces = 2});
  EXPECT_GT(frame.samples, 3000u);
  // Most of it at the rim, where the scene shows once more on a pixel or two
  EXPECT_LT(frame.l1Of8Bit, 5.0);
  EXPECT_TRUE(frame.finite);
  EXPECT_GE(frame.output.counters["path_types"], 2u);
}

TEST(Perturbation, ShowsWhatStandsInTheFocusOfALens) {
  // A small part of a wall, within a triangle, shows large and several times
  for (const float x : {0.0f, -0.3f}) {
    test::SceneBuilder builder;
    const int glass = builder.reflective(1.0f);
    builder.scene().materials[glass].refraction = 1.5f;
    builder.add(scene::makeImplicit(implicit::ellipsoidSurface({0.62, 0.62, 0.2}), 48,
                                    scene::UvMode::Metres),
                glass, test::rotation(12.0f, {0.0f, 1.0f, 0.0f}));
    scene::BoxShape room{.size = {6.0f, 3.0f, 5.3f}};
    room.segments = {6, 3, 6};
    room.inward = true;
    builder.add(scene::makeBox(room, scene::UvMode::Metres), builder.diffuse({0.7f, 0.3f, 0.2f}));
    builder.constantEnvironment(Vec3(0.5f, 0.6f, 0.8f));
    Comparison frame(builder.scene(), cameraAt({x, 0.28f, 2.58f}, {0.0f, -0.1f, 0.0f}),
                     R"({"bounces": 2})", {.bounces = 2});
    EXPECT_GT(frame.samples, 15000u);
    // Unless long images are halved: 5326 and 1005 uncovered samples, L1 24.6 and 4.6
    EXPECT_LT(frame.output.counters["environment"], 400u) << x;
    EXPECT_LT(frame.l1Of8Bit, 1.6) << x;
  }
}

TEST(Perturbation, SeesThroughGlassThatDoesNotBendAsIfItWereNotThere) {
  test::SceneBuilder builder = stage(sphereMesh(0.4), test::translation({0.2f, 0.3f, 1.0f}));
  builder.scene().materials[builder.scene().objects[0].material].refraction = 1.0f;
  Comparison frame(builder.scene(), kFront, R"({"bounces": 2, "tessellation_error": 4})",
                   {.bounces = 2});
  EXPECT_GT(frame.samples, 3000u);
  EXPECT_LT(frame.l1Of8Bit, 0.05);
  EXPECT_LT(frame.output.counters["environment"], frame.samples * 6 / 10);
}

TEST(Perturbation, OrdersComeNearerToTheRays) {
  const auto l1 = [](const char* order) {
    return Comparison(stage(sphereMesh(0.7), test::translation({0.0f, 0.3f, 0.0f})).scene(), kFront,
                      std::string(R"({"order": ")") + order + R"(", "sample_spacing": 8})")
        .l1Of8Bit;
  };
  const double nearest = l1("nearest");
  const double linear = l1("linear");
  const double quadratic = l1("quadratic");
  const double automatic = l1("auto");
  EXPECT_LT(linear, 0.5 * nearest)
      << nearest << " " << linear << " " << quadratic << " " << automatic;
  EXPECT_LT(automatic, 1.05 * linear) << quadratic;
  EXPECT_LT(automatic, 1.05 * quadratic);
}

TEST(Perturbation, JoinsReflectionsThatMerge) {
  test::SceneBuilder builder;
  builder.add(scene::makeImplicit(implicit::vaseSurface(), 48, scene::UvMode::Metres),
              builder.reflective(1.0f, 0.0f), test::translation({0.0f, -0.8f, 0.0f}));
  scene::BoxShape room{.size = {8.0f, 5.0f, 9.0f}};
  room.segments = {8, 5, 9};
  room.inward = true;
  builder.add(scene::makeBox(room, scene::UvMode::Metres), builder.diffuse({0.6f, 0.5f, 0.3f}));
  builder.constantEnvironment(Vec3(5.0f, 0.0f, 0.0f));
  Comparison frame(builder.scene(), cameraAt({0.2f, 0.9f, 3.6f}, {0.0f, 0.2f, 0.0f}));
  EXPECT_GT(frame.samples, 5000u);
  // Nothing but gaps shows the environment: 741 samples with gaps along folds, 149 where triangles
  // are left out in which a reflection ends
  EXPECT_LT(frame.output.counters["environment"], 100u);
}

TEST(Perturbation, ConcaveMirrorsShowAFloorUpToTheirRim) {
  // Their images are large where the floor itself is seen small, and end at the mirror's cut rim
  test::SceneBuilder builder;
  builder.add(
      scene::makeImplicit(implicit::formulaSurface("z - 0.35*(x^2 + y^2)", {},
                                                   {{-1.2, -1.2, -0.2}, {1.2, 1.2, 1.2}}, "dish"),
                          48, scene::UvMode::Metres),
      builder.reflective(1.0f, 0.0f), test::translation({0.0f, 0.8f, -0.6f}));
  scene::BoxShape floor{.size = {6.0f, 0.1f, 6.0f}};
  floor.segments = {30, 1, 30};
  builder.add(scene::makeBox(floor, scene::UvMode::Metres), builder.diffuse({0.6f, 0.5f, 0.3f}),
              test::translation({0.0f, -0.05f, 0.0f}));
  builder.constantEnvironment(Vec3(0.2f, 0.4f, 1.0f));
  Comparison frame(builder.scene(), cameraAt({0.4f, 1.3f, 2.6f}, {0.0f, 0.6f, -0.3f}));
  EXPECT_GT(frame.samples, 10000u);
  EXPECT_LT(frame.l1Of8Bit, 0.05);
}

/// A mirror in a closed room of six quads.
test::SceneBuilder roomWith(const std::string& formula, const implicit::Domain& domain, int cells,
                            const Vec3& place) {
  test::SceneBuilder builder;
  builder.add(scene::makeImplicit(implicit::formulaSurface(formula, {}, domain, "mirror"), cells,
                                  scene::UvMode::Metres),
              builder.reflective(1.0f, 0.0f), test::translation(place));
  const std::array<Vec3, 6> colors{Vec3(0.7f, 0.1f, 0.1f), Vec3(0.1f, 0.5f, 0.1f),
                                   Vec3(0.3f, 0.3f, 0.3f), Vec3(0.8f, 0.8f, 0.7f),
                                   Vec3(0.6f, 0.5f, 0.2f), Vec3(0.1f, 0.2f, 0.6f)};
  for (int face = 0; face < 6; ++face) {
    scene::BoxShape wall{.size = {8.0f, 5.0f, 9.0f}};
    wall.inward = true;
    wall.faces = {};
    wall.faces[static_cast<std::size_t>(face)] = true;
    builder.add(scene::makeBox(wall, scene::UvMode::Metres),
                builder.diffuse(colors[static_cast<std::size_t>(face)]),
                test::translation({0.0f, 2.5f, 0.0f}));
  }
  builder.constantEnvironment(Vec3(1.0f, 0.0f, 1.0f));
  return builder;
}

TEST(Perturbation, ConcaveMirrorsShowARoomOfSixQuadsWithoutGaps) {
  // Its focus enlarges what lies there: halved edges of 3 cm miss by many pixels
  Comparison frame(roomWith("z - 0.35*(x^2 + y^2)", {{-1.2, -1.2, -0.1}, {1.2, 1.2, 0.5}}, 48,
                            {0.0f, 2.5f, -4.3f})
                       .scene(),
                   cameraAt({0.6f, 2.2f, -0.2f}, {0.0f, 2.5f, -4.3f}));
  EXPECT_GT(frame.samples, 15000u);
  EXPECT_LE(frame.output.counters["environment"], 2u);
  EXPECT_LT(frame.l1Of8Bit, 0.05);
}

TEST(Perturbation, WavedMirrorsShowARoomOfSixQuads) {
  // Crests and hollows each show a point several times, with folds between them (magenta: open)
  Comparison frame(roomWith("y - 0.1*sin(5*x)*cos(5*z)", {{-0.5, -0.2, -0.5}, {0.5, 0.2, 0.5}}, 24,
                            {0.0f, 0.8f, -1.0f})
                       .scene(),
                   cameraAt({0.3f, 2.0f, 1.2f}, {0.0f, 0.75f, -1.0f}));
  EXPECT_GT(frame.samples, 5000u);
  EXPECT_LT(frame.output.counters["environment"], 900u);
  EXPECT_LT(frame.l1Of8Bit, 8.0);
}

TEST(Perturbation, GapsAreToldFromTheSky) {
  const auto marked = [](const Comparison& frame) {
    return static_cast<std::uint64_t>(std::ranges::count_if(
        frame.masks, [](std::uint16_t m) { return (m & raster::kMaskDisoccluded) != 0; }));
  };
  // In a closed room every ray hits: what shows the environment is a gap
  Comparison closed(roomWith("y - 0.1*sin(5*x)*cos(5*z)", {{-0.5, -0.2, -0.5}, {0.5, 0.2, 0.5}}, 24,
                             {0.0f, 0.8f, -1.0f})
                        .scene(),
                    cameraAt({0.3f, 2.0f, 1.2f}, {0.0f, 0.75f, -1.0f}), "{}", {}, true);
  EXPECT_GT(closed.output.counters["environment"], 10u);
  EXPECT_EQ(closed.output.counters["disoccluded"], closed.output.counters["environment"]);
  EXPECT_EQ(marked(closed), closed.output.counters["disoccluded"]);
  // Under the sky a ball before a floor and a box shows much of it, and has no gaps
  test::SceneBuilder builder = stage(sphereMesh(0.7), test::translation({0.0f, 0.3f, 0.0f}));
  Comparison open(builder.scene(), kFront, "{}", {}, true);
  EXPECT_GT(open.output.counters["environment"], 3000u);
  EXPECT_LT(open.output.counters["disoccluded"], 20u);
  // Not asked for, not counted
  Comparison plain(builder.scene(), kFront);
  EXPECT_EQ(plain.output.counters.count("disoccluded"), 0u);
  EXPECT_EQ(plain.output.counters["environment"], open.output.counters["environment"]);
}

TEST(Perturbation, TracedGapsShowWhatRaysSee) {
  const auto room = [] {
    return roomWith("y - 0.1*sin(5*x)*cos(5*z)", {{-0.5, -0.2, -0.5}, {0.5, 0.2, 0.5}}, 24,
                    {0.0f, 0.8f, -1.0f})
        .scene();
  };
  const scene::Camera camera = cameraAt({0.3f, 2.0f, 1.2f}, {0.0f, 0.75f, -1.0f});
  Comparison open(room(), camera);
  Comparison filled(room(), camera, R"({"gaps": "trace"})");
  const std::uint64_t gaps = open.output.counters["environment"];
  EXPECT_GT(gaps, 10u);
  EXPECT_EQ(filled.output.counters["environment"], gaps);
  EXPECT_EQ(filled.output.counters["traced_gaps"], gaps);
  EXPECT_EQ(std::ranges::count_if(filled.masks,
                                  [](std::uint16_t m) { return (m & raster::kMaskRetraced) != 0; }),
            static_cast<std::ptrdiff_t>(gaps));
  EXPECT_LT(filled.l1Of8Bit, 0.1 * open.l1Of8Bit);
  // Magenta, which nothing in the room shows, is gone
  EXPECT_EQ(std::ranges::count(filled.reflection, Vec3(1.0f, 0.0f, 1.0f)), 0);
  EXPECT_EQ(std::ranges::count(open.reflection, Vec3(1.0f, 0.0f, 1.0f)),
            static_cast<std::ptrdiff_t>(gaps));
}

TEST(Perturbation, GapsOfLaterReflectionsAreCounted) {
  // A plane mirror shows the waves: gaps lie in what it shows
  test::SceneBuilder builder = roomWith(
      "y - 0.1*sin(5*x)*cos(5*z)", {{-0.5, -0.2, -0.5}, {0.5, 0.2, 0.5}}, 24, {0.0f, 0.8f, -1.0f});
  builder.add(scene::makePlane({2.0f, 2.0f}, {1, 1}, scene::UvMode::Metres),
              builder.reflective(1.0f, 0.0f),
              test::translation({0.0f, 1.2f, -2.0f}) * test::rotation(90.0f, {1.0f, 0.0f, 0.0f}));
  Comparison frame(builder.scene(), cameraAt({0.3f, 1.6f, 1.2f}, {0.0f, 1.2f, -2.0f}),
                   R"({"bounces": 2})", {.bounces = 2}, true);
  const std::uint64_t open = frame.output.counters["environment"];
  EXPECT_GT(open, 20u);
  // At outlines Embree's path may leave the mirrors before
  EXPECT_LE(frame.output.counters["disoccluded"], open);
  EXPECT_GE(frame.output.counters["disoccluded"], open - open / 10);
}

TEST(Perturbation, SeesTheSkyThroughAPaneAlongTheRefractedRay) {
  test::SceneBuilder builder;
  implicit::Domain domain{glm::dvec3(-1.0, -1.0, -0.1), glm::dvec3(1.0, 1.0, 0.1)};
  builder.add(scene::makeImplicit(implicit::planeSurface({0.0, 0.0, 1.0}, 0.0, domain), 8,
                                  scene::UvMode::Metres),
              builder.reflective(1.0f), test::rotation(50.0f, {1, 0, 0}));
  scene::Scene& scene = builder.scene();
  EXPECT_TRUE(scene.objects[0].planar);
  scene.materials[scene.objects[0].material].refraction = 1.5f;
  scene.environment.type = scene::EnvironmentType::Gradient;
  scene.environment.color = Vec3(0.0f, 0.0f, 1.0f);
  scene.environment.horizon = Vec3(0.8f, 0.7f, 0.4f);
  scene.environment.ground = Vec3(0.6f, 0.1f, 0.0f);
  Comparison frame(scene, kFront);
  EXPECT_GT(frame.samples, 5000u);
  EXPECT_EQ(frame.output.counters["environment"], frame.samples);
  EXPECT_LT(frame.l1Of8Bit, 0.05);
}

TEST(Perturbation, TakesASurfaceThatAMaskCutsForAMesh) {
  scene::Scene scene = stage(sphereMesh(0.7), test::translation({0.0f, 0.3f, 0.0f})).scene();
  scene.materials[scene.objects[0].material].alphaMode = scene::AlphaMode::Mask;
  const auto method = perturbationEntry().make(config::parseText("{}", "options"));
  ASSERT_EQ(method->unsupported(scene).size(), 1u);
  EXPECT_NE(method->unsupported(scene)[0].reason.find("alpha_cutoff"), std::string::npos);
}

TEST(Perturbation, NamesReflectorsThatItCannotDo) {
  const scene::Scene glossy =
      stage(sphereMesh(0.7), test::translation({0.0f, 0.3f, 0.0f}), 0.4f).scene();
  const auto method = perturbationEntry().make(config::parseText("{}", "options"));
  const std::vector<Unsupported> unsupported = method->unsupported(glossy);
  ASSERT_EQ(unsupported.size(), 1u);
  EXPECT_EQ(unsupported[0].object, 1);
  EXPECT_NE(unsupported[0].reason.find("glossy"), std::string::npos);
}

/// Alhazen's problem in the plane of centre, eye and point: the angle at which the sphere's normal
/// halves the angle between them, by bisection.
glm::dvec3 alhazen(const glm::dvec3& eye, const glm::dvec3& point, double radius) {
  const glm::dvec3 u = glm::normalize(eye);
  const glm::dvec3 v = glm::normalize(point - glm::dot(point, u) * u);
  double low = 0.0;
  double high = std::acos(glm::dot(u, glm::normalize(point)));
  const auto at = [&](double angle) {
    return radius * (std::cos(angle) * u + std::sin(angle) * v);
  };
  for (int i = 0; i < 200; ++i) {
    const double middle = 0.5 * (low + high);
    const glm::dvec3 x = at(middle);
    const glm::dvec3 n = x / radius;
    // Too near to the eye while the ray from the eye leaves steeper than the one to the point
    const double toEye = glm::dot(glm::normalize(eye - x), n);
    const double toPoint = glm::dot(glm::normalize(point - x), n);
    (toEye > toPoint ? low : high) = middle;
  }
  return at(0.5 * (low + high));
}

TEST(Perturbation, FindsAlhazensPoints) {
  const double radius = 0.7;
  const implicit::Surface sphere = implicit::sphereSurface(radius);
  const scene::Camera camera = cameraAt({0.0f, 0.0f, 3.0f}, {0.0f, 0.0f, 0.0f});
  Box3 bounds;
  bounds.extend(Vec3(-0.7f));
  bounds.extend(Vec3(0.7f));
  Box3 around;
  around.extend(Vec3(-3.0f));
  around.extend(Vec3(3.0f));
  const perturbation::View view{camera, 640, 480};
  perturbation::PathOptions options;
  options.errorPixels = 0.01f;
  const perturbation::Turn turn{&sphere, bounds};
  const perturbation::Reflector reflector({&turn, 1}, nullptr, around, view, options);
  const double metresPerPixel = 2.3 * scene::pixelSpreadRad(camera, 480);
  perturbation::PathCounts counts;
  perturbation::RayOctree::Cursor cursor;
  int asked = 0;
  for (int i = 0; i < 400; ++i) {
    // Points all around, but those that the sphere hides
    const double z = 1.8 * (std::fmod(i * 0.618034, 1.0) - 0.3);
    const double angle = 2.399963 * i;
    const double r = 0.9 + 0.003 * i;
    const glm::dvec3 point(r * std::cos(angle), r * std::sin(angle), z);
    const glm::dvec3 x = alhazen({0.0, 0.0, 3.0}, point, radius);
    if (glm::dot(x, point - x) < 0.05 || glm::dot(x, glm::dvec3(0, 0, 3) - x) < 0.05) continue;
    ++asked;
    const perturbation::Reflections found = reflector.reflectionsOf(point, false, cursor, counts);
    ASSERT_EQ(found.count, 1u) << i;
    EXPECT_LT(glm::distance(found.at[0].x, x), 0.05 * metresPerPixel) << i;
    const glm::dvec3 eye(0.0, 0.0, 3.0);
    EXPECT_NEAR(glm::distance(found.at[0].image, eye),
                glm::distance(x, eye) + glm::distance(x, point), 1e-3);
  }
  EXPECT_GT(asked, 200);
}

}  // namespace
}  // namespace catoptric::methods
