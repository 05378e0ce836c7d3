#include "methods/billboards/billboards.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "core/error.h"
#include "frame/test_scenes.h"
#include "methods/testing/gl_harness.h"

namespace catoptric::methods {
namespace {

const RunSettings kSettings = test::framesOf(96, 96, 1, true);

/// An unlit quad with colours that change evenly over it, its middle at `place`.
scene::Mesh coloured(const Vec2& size) {
  scene::Mesh mesh = scene::makePlane(size, {1, 1}, scene::UvMode::Unit);
  for (const Vec3& p : mesh.positions)
    mesh.colors.push_back(Vec3(0.2f, 0.3f, 0.4f) + 0.2f * Vec3(p.x / size.x, p.z / size.y, 0.5f));
  return mesh;
}

int unlit(test::SceneBuilder& builder) {
  scene::Material material;
  material.unlit = true;
  builder.scene().materials.push_back(material);
  return static_cast<int>(builder.scene().materials.size()) - 1;
}

scene::Camera cameraAt(const Vec3& eye) {
  return scene::lookAt(eye, Vec3(0.0f), {0.0f, 1.0f, 0.0f}, radians(40.0f));
}

/// A mirror ball between coloured quads.
test::SceneBuilder ballAndQuads(int reflectors = 1) {
  test::SceneBuilder builder;
  builder.constantEnvironment(Vec3(0.25f));
  for (int i = 0; i < reflectors; ++i)
    builder.add(scene::makeSphere(0.4f, 64, 32, scene::UvMode::Unit), builder.reflective(0.9f),
                test::translation({1.0f * static_cast<float>(i), 0.0f, 0.0f}));
  const int material = unlit(builder);
  builder.add(coloured({4.0f, 4.0f}), material, test::translation({0.0f, -0.6f, 0.0f}));
  builder.add(coloured({4.0f, 3.0f}), material,
              test::translation({0.0f, 0.9f, 4.0f}) * test::rotation(-80.0f, {1.0f, 0.0f, 0.0f}));
  builder.add(coloured({1.0f, 1.5f}), material,
              test::translation({-1.2f, 0.3f, 0.2f}) * test::rotation(75.0f, {0.0f, 0.2f, 1.0f}));
  return builder;
}

TEST(Billboards, FlatQuadsAreThoseThatTracedSees) {
  test::GlStage stage(ballAndQuads().scene(), kSettings);
  test::GlMethod method(stage, billboardsEntry(), R"({"texture_size": 256, "objects": ["object1",
      "object2", "object3"]})");
  const scene::Camera camera = cameraAt({0.3f, 0.9f, 2.2f});
  const FrameOutput output = method.render(camera);
  const test::TracedSamples samples(stage, camera, {});
  std::size_t off = 0;
  for (std::size_t i = 0; i < samples.ours.size(); ++i) {
    const Vec3 d = glm::abs(samples.ours[i] - samples.traced[i]);
    off += std::max(d.x, std::max(d.y, d.z)) > 0.5f / 255.0f ? 1 : 0;
  }
  EXPECT_GT(samples.ours.size(), 400u);
  EXPECT_LT(output.counters.at("environment"), 2 * samples.ours.size() / 3);
  // At the quads' edges: a texel is half a sample wide there
  EXPECT_LE(static_cast<double>(off), 0.03 * static_cast<double>(samples.ours.size()));
}

// A white lamp in black is its coverage of lobes, which many rays measure. One look-up where the
// lobe's middle ray meets the lamp was off by more than eight rays are: 0.14, 0.60, 0.42 and 1.05
// of the mean.
TEST(Billboards, ALampCoversLobesInPart) {
  for (const bool ggx : {false, true}) {
    for (const float rough : {0.3f, 0.6f}) {
      test::SceneBuilder builder;
      builder.constantEnvironment(Vec3(0.0f));
      const int floor = builder.reflective(1.0f, rough);
      if (ggx) builder.scene().materials.back().lobe = scene::LobeModel::Ggx;
      builder.add(scene::makePlane({4.0f, 4.0f}, {1, 1}, scene::UvMode::Unit), floor);
      builder.add(scene::makePlane({0.5f, 0.5f}, {1, 1}, scene::UvMode::Unit), unlit(builder),
                  test::translation({0.0f, 0.8f, 0.0f}) * test::rotation(150.0f, {1, 0, 0}));
      test::GlStage stage(builder.scene(), kSettings);
      const scene::Camera camera = cameraAt({0.3f, 1.0f, 2.2f});
      test::GlMethod(stage, billboardsEntry(), R"({"fallback": "none"})").render(camera);
      const test::TracedSamples samples(stage, camera, {.rays = 256});
      const test::TracedSamples eight(stage, camera, {.rays = 8});
      double off = 0.0, sum = 0.0, ours = 0.0, offEight = 0.0;
      for (std::size_t i = 0; i < samples.ours.size(); ++i) {
        off += std::abs(static_cast<double>(samples.ours[i].x - samples.traced[i].x));
        offEight += std::abs(static_cast<double>(eight.traced[i].x - samples.traced[i].x));
        sum += static_cast<double>(samples.traced[i].x);
        ours += static_cast<double>(samples.ours[i].x);
      }
      std::printf("%s %.1f: error %.3f of the mean (8 rays %.3f), energy %.3f\n",
                  ggx ? "ggx" : "phong", rough, off / sum, offEight / sum, ours / sum);
      EXPECT_LT(off, 0.3 * sum) << ggx << " " << rough;
      EXPECT_LT(off, 0.75 * offEight) << ggx << " " << rough;
      EXPECT_NEAR(ours / sum, 1.0, 0.06) << ggx << " " << rough;
    }
  }
}

// The images of `ballAndQuads` need 4 MiB or more.
TEST(Billboards, ReflectorsWhoseImagesDoNotFitAreTraced) {
  test::GlStage stage(ballAndQuads(2).scene(), kSettings);
  const scene::Camera camera = cameraAt({0.3f, 0.9f, 2.2f});
  const FrameOutput output =
      test::GlMethod(stage, billboardsEntry(), R"({"memory_mib": 1})").render(camera);
  EXPECT_EQ(output.counters.at("traced_reflectors"), 2u);
  EXPECT_EQ(output.counters.at("impostors_rendered"), 0u);
  const test::TracedSamples samples(stage, camera, {});
  EXPECT_EQ(output.counters.at("traced_samples"), samples.ours.size());
  EXPECT_EQ(samples.ours, samples.traced);
  const std::vector<std::uint16_t> masks = raster::readMasks(stage.gbuffer.masks);
  EXPECT_EQ(static_cast<std::size_t>(std::ranges::count_if(
                masks, [](std::uint16_t mask) { return (mask & raster::kMaskRetraced) != 0; })),
            samples.ours.size());
  try {
    test::GlMethod(stage, billboardsEntry(), R"({"memory_mib": 1, "fallback": "none"})")
        .render(camera);
    FAIL() << "it fits";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ExitCode::OutOfMemory);
    EXPECT_NE(std::string(error.what()).find("memory_mib"), std::string::npos);
  }
}

// The balls stand on the floor, which sees them under large angles; from the ball above they are
// far.
TEST(Billboards, AFloorAmongObjectsIsTraced) {
  test::SceneBuilder builder;
  builder.constantEnvironment(Vec3(0.25f));
  const int mirror = builder.reflective(0.9f);
  builder.add(scene::makePlane({4.0f, 4.0f}, {1, 1}, scene::UvMode::Unit), mirror);
  builder.add(scene::makeSphere(0.3f, 32, 16, scene::UvMode::Unit), mirror,
              test::translation({0.0f, 1.8f, 0.0f}));
  const int material = unlit(builder);
  for (const Mat4& turn :
       {Mat4(1.0f), test::rotation(72.0f, {0, 1, 0}), test::rotation(144.0f, {0, 1, 0}),
        test::rotation(216.0f, {0, 1, 0}), test::rotation(288.0f, {0, 1, 0})})
    builder.add(scene::makeSphere(0.4f, 32, 16, scene::UvMode::Unit), material,
                turn * test::translation({0.7f, 0.4f, 0.0f}));
  test::GlStage stage(builder.scene(), kSettings);
  const scene::Camera camera =
      scene::lookAt({0.0f, 3.0f, 6.0f}, {0.0f, 1.2f, 0.0f}, {0.0f, 1.0f, 0.0f}, radians(50.0f));
  const FrameOutput output = test::GlMethod(stage, billboardsEntry()).render(camera);
  const test::TracedSamples samples(stage, camera, {});
  const std::vector<std::uint32_t> ids = raster::readIds(stage.gbuffer.object);
  std::size_t ofFloor = 0;
  for (std::size_t i = 0; i < samples.ours.size(); ++i) {
    if (ids[samples.places[i]] != 1) continue;
    ++ofFloor;
    EXPECT_EQ(samples.ours[i], samples.traced[i]);
  }
  EXPECT_EQ(output.counters.at("unfit"), 1u);
  EXPECT_EQ(output.counters.at("traced_samples"), ofFloor);
  EXPECT_GT(ofFloor, 500u);
  EXPECT_GT(samples.ours.size(), ofFloor);
  EXPECT_GT(output.counters.at("impostors_rendered"), 0u) << "for the ball";
}

TEST(Billboards, BallsOfFewSamplesAreTracedWhileAWideOneHasImages) {
  test::SceneBuilder builder = ballAndQuads();
  const int mirror = builder.reflective(0.9f);
  for (int i = 0; i < 9; ++i)
    builder.add(scene::makeSphere(0.01f, 12, 6, scene::UvMode::Unit), mirror,
                test::translation({0.1f * static_cast<float>(i - 4), -0.55f, 0.6f}));
  test::GlStage stage(builder.scene(), kSettings);
  const FrameOutput output =
      test::GlMethod(stage, billboardsEntry(), R"({"memory_mib": 32, "most": 4})")
          .render(cameraAt({0.3f, 0.9f, 2.2f}));
  std::set<std::uint32_t> shown;
  for (const std::uint32_t id : raster::readIds(stage.gbuffer.object))
    if (id > 4) shown.insert(id);
  EXPECT_GT(shown.size(), 3u);
  EXPECT_EQ(output.counters.at("traced_reflectors"), shown.size());
  EXPECT_GT(output.counters.at("impostors_rendered"), 0u);
}

TEST(Billboards, NamesOfNoObjectAreRefused) {
  test::GlStage stage(ballAndQuads().scene(), kSettings);
  EXPECT_THROW(test::GlMethod(stage, billboardsEntry(), R"({"objects": ["object1", "objekt2"]})"),
               UsageError);
}

TEST(Billboards, IntersectionsAreTwiceTheDiffusePlusTheOthers) {
  for (const std::uint32_t reflectors : {1u, 2u, 3u, 5u, 9u}) {
    test::GlStage stage(ballAndQuads(static_cast<int>(reflectors)).scene(), kSettings);
    test::GlMethod method(stage, billboardsEntry(),
                          R"({"bounces": 2, "least": 0, "fallback": "none"})");
    const FrameOutput output = method.render(cameraAt({0.3f, 0.9f, 2.8f}));
    const std::vector<std::uint32_t> ids = raster::readIds(stage.gbuffer.object);
    const auto samples = static_cast<std::uint64_t>(
        std::ranges::count_if(ids, [&](std::uint32_t id) { return id >= 1 && id <= reflectors; }));
    constexpr std::uint64_t kDiffuse = 3;
    const std::uint64_t again = output.counters.at("second_order");
    EXPECT_EQ(again > 20u, reflectors > 1) << reflectors;
    EXPECT_EQ(output.counters.at("intersections"),
              samples * (kDiffuse + reflectors - 1) + again * kDiffuse)
        << reflectors;
  }
}

TEST(Billboards, AChangeOfViewRendersNoImpostor) {
  test::GlStage stage(ballAndQuads(2).scene(), kSettings);
  test::GlMethod method(stage, billboardsEntry());
  EXPECT_GT(method.render(cameraAt({0.3f, 0.9f, 2.8f})).counters.at("impostors_rendered"), 0u);
  const FrameOutput output = method.render(cameraAt({-0.3f, 0.6f, 3.1f}));
  EXPECT_EQ(output.counters.at("impostors_rendered"), 0u);
  EXPECT_GT(output.counters.at("impostors_reused"), 0u);
}

TEST(Billboards, TheEnvironmentFollowsWhileNoReflectorIsInView) {
  test::SceneBuilder builder = ballAndQuads();
  builder.move(3, {2.0f, 0.0f, 0.0f}, 1.0f);
  test::GlStage stage(builder.scene(), kSettings);
  test::GlMethod method(stage, billboardsEntry(), R"({"objects": ["object1"]})");
  const scene::Camera seen = cameraAt({0.3f, 0.9f, 2.2f});
  method.render(seen);
  const std::vector<Vec3> before = test::TracedSamples(stage, seen, {}).ours;
  const scene::Camera away =
      scene::lookAt(seen.eye(), 2.0f * seen.eye(), {0.0f, 1.0f, 0.0f}, radians(40.0f));
  method.render(away, stage.moveTo(1.0));
  method.render(seen);
  const std::vector<Vec3> after = test::TracedSamples(stage, seen, {}).ours;
  EXPECT_NE(before, after);
  test::GlMethod(stage, billboardsEntry(), R"({"objects": ["object1"]})").render(seen);
  EXPECT_EQ(after, test::TracedSamples(stage, seen, {}).ours);
}

TEST(Billboards, ClampedTexelsOfImagesAreCounted) {
  for (const float radiance : {1.0f, 1e6f}) {
    test::SceneBuilder builder;
    builder.constantEnvironment(Vec3(0.25f));
    builder.add(scene::makeSphere(0.4f, 64, 32, scene::UvMode::Unit), builder.reflective(0.9f));
    const int material = unlit(builder);
    builder.scene().materials[static_cast<std::size_t>(material)].baseColor = Vec3(0, radiance, 0);
    builder.add(scene::makePlane({2.0f, 2.0f}, {1, 1}, scene::UvMode::Unit), material,
                test::translation({0.0f, -0.5f, 0.0f}));
    test::GlStage stage(builder.scene(), kSettings);
    test::GlMethod method(stage, billboardsEntry(),
                          R"({"plane_size": 32, "objects": ["object1"]})");
    // The quad fills its image, but for texels at the edges
    const std::uint64_t least = radiance > 65504.0f ? 30u * 30u : 0u;
    const std::uint64_t most = radiance > 65504.0f ? 32u * 32u : 0u;
    for (const float x : {0.3f, -0.3f}) {  // drawn, then kept
      const FrameOutput output = method.render(cameraAt({x, 0.4f, 2.2f}));
      EXPECT_EQ(output.counters.at("impostors_rendered"), x > 0.0f ? 1u : 0u);
      EXPECT_GE(output.counters.at("clamped_images"), least);
      EXPECT_LE(output.counters.at("clamped_images"), most);
      EXPECT_EQ(output.counters.at("clamped_cube_map"), 0u);
      const std::vector<std::uint16_t> masks = raster::readMasks(stage.gbuffer.masks);
      const auto marked = static_cast<std::uint64_t>(std::ranges::count_if(
          masks, [](std::uint16_t mask) { return (mask & raster::kMaskClamped) != 0; }));
      EXPECT_EQ(output.counters.at("shows_clamped"), marked);
      EXPECT_EQ(marked > 20, radiance > 65504.0f);
    }
  }
}

// What a ray sees of a floor between walls: the floor, a blend on the walls, else the environment.
Vec3 ofBox(const Vec3& origin, const Vec3& direction, float half, float y, float height,
           const Vec3& floor, const Vec3& environment) {
  const glm::dvec3 o(origin);
  const glm::dvec3 d(direction);
  const auto inside = [&](double a, double b) {
    return std::abs(a) <= half && b >= 0 && b <= height;
  };
  // Five quads; of two hits the later one is where the ray leaves the box
  double last = 0.0;
  Vec3 seen = environment;
  const auto hit = [&](double t, bool on, float share) {
    if (!(t > last) || !on) return;
    last = t;
    seen = floor + share * (environment - floor);
  };
  const double t = (y - o.y) / d.y;
  const glm::dvec3 p = o + t * d;
  hit(t, std::abs(p.x) <= half && std::abs(p.z) <= half && d.y < 0.0, 0.0f);
  for (const int axis : {0, 2}) {
    for (const double side : {-1.0, 1.0}) {
      const double s = (side * half - o[axis]) / d[axis];
      const glm::dvec3 q = o + s * d;
      // Leaves, does not enter
      if (d[axis] * side <= 0.0) continue;
      hit(s, inside(q[2 - axis], q.y - y), static_cast<float>((q.y - y) / height));
    }
  }
  return seen;
}

TEST(Billboards, WallsTurnAFloorIntoTheEnvironment) {
  const Vec3 environment(0.25f, 0.5f, 0.75f);
  const Vec3 floor(1.0f, 0.25f, 0.0f);
  test::SceneBuilder builder;
  builder.constantEnvironment(environment);
  builder.add(scene::makeSphere(0.4f, 96, 48, scene::UvMode::Unit), builder.reflective(0.9f));
  const int material = unlit(builder);
  builder.scene().materials[static_cast<std::size_t>(material)].baseColor = floor;
  builder.add(scene::makePlane({3.0f, 3.0f}, {1, 1}, scene::UvMode::Unit), material,
              test::translation({0.0f, -0.5f, 0.0f}));
  test::GlStage stage(builder.scene(), kSettings);
  test::GlMethod method(stage, billboardsEntry(),
                        R"({"transition_height": 0.4, "objects": ["object1"]})");
  const scene::Camera camera = cameraAt({0.3f, 0.4f, 2.2f});
  const FrameOutput output = method.render(camera);
  EXPECT_GT(output.counters.at("transition"), 30u);
  const test::TracedSamples samples(stage, camera, {});
  std::size_t off = 0;
  for (std::size_t i = 0; i < samples.points.size(); ++i) {
    const trace::ReflectionPoint& point = samples.points[i];
    const Vec3 direction = glm::normalize(glm::reflect(point.direction, point.normal));
    const Vec3 truth = ofBox(point.position, direction, 1.5f, -0.5f, 0.4f, floor, environment);
    const Vec3 d = glm::abs(truth - samples.ours[i]);
    off += std::max(d.x, std::max(d.y, d.z)) > 1.0f / 255.0f ? 1 : 0;
  }
  EXPECT_GT(samples.points.size(), 500u);
  EXPECT_LE(off, 2u);
}

TEST(Billboards, WhatIsFarOffFades) {
  test::SceneBuilder builder = ballAndQuads();
  test::GlStage stage(builder.scene(), kSettings);
  const scene::Camera camera = cameraAt({0.3f, 0.9f, 2.2f});
  constexpr const char* kObjects = R"("objects": ["object1", "object2", "object3"])";
  test::GlMethod(stage, billboardsEntry(), std::string("{") + kObjects + "}").render(camera);
  const std::vector<float> plain = raster::readRgba(stage.gbuffer.reflection);
  test::GlMethod(stage, billboardsEntry(), std::string(R"({"attenuation": 2, )") + kObjects + "}")
      .render(camera);
  const test::TracedSamples samples(stage, camera, {.fadeMetres = 2.0f});
  int offTraced = 0;
  int compared = 0;
  int off = 0;
  for (std::size_t i = 0; i < samples.points.size(); ++i) {
    // The floor in closed form
    const trace::ReflectionPoint& point = samples.points[i];
    const Vec3 direction = glm::normalize(glm::reflect(point.direction, point.normal));
    const float t = (-0.6f - point.position.y) / direction.y;
    const Vec3 p = point.position + t * direction;
    if (!(t > 0.0f) || std::abs(p.x) > 1.9f || p.z > 1.9f || p.z < -1.9f || p.x < -0.9f) continue;
    ++compared;
    const float before = plain[4 * samples.places[i] + 1];
    off += std::abs(samples.ours[i].y - before * std::exp(-t / 2.0f)) > 2e-3f ? 1 : 0;
    offTraced += glm::length(samples.ours[i] - samples.traced[i]) > 1.0f / 255.0f ? 1 : 0;
  }
  EXPECT_GT(compared, 100);
  EXPECT_LE(off, compared / 50);
  EXPECT_LE(offTraced, compared / 50);
}

std::string with(const std::string& options, const char* unit) {
  return "{" + options + (options.empty() ? "" : ", ") + R"("intersect_on": ")" + unit + R"("})";
}

TEST(Billboards, TheProcessorShowsWhatTheDeviceShows) {
  for (const char* options :
       {"", R"("bounces": 2, "second_diffuse": true, "least": 0)", R"("transition_height": 0.4)",
        R"("transition_height": 0.4, "share_environment": true)", R"("attenuation": 2)",
        R"("attenuation": 2, "bounces": 2, "least": 0)"}) {
    test::GlStage stage(ballAndQuads(3).scene(), kSettings);
    const scene::Camera camera = cameraAt({0.3f, 0.9f, 2.8f});
    std::vector<float> shown[2];
    std::vector<std::uint16_t> masks[2];
    FrameOutput outputs[2];
    for (int i = 0; i < 2; ++i) {
      outputs[i] =
          test::GlMethod(stage, billboardsEntry(), with(options, i == 0 ? "device" : "processor"))
              .render(camera);
      shown[i] = raster::readRgba(stage.gbuffer.reflection);
      masks[i] = raster::readMasks(stage.gbuffer.masks);
    }
    const std::vector<std::uint32_t> ids = raster::readIds(stage.gbuffer.object);
    int samples = 0;
    int off = 0;
    int offMasks = 0;
    for (std::size_t i = 0; i < ids.size(); ++i) {
      if (ids[i] < 1 || ids[i] > 3) continue;
      ++samples;
      float most = 0.0f;
      for (std::size_t c = 0; c < 3; ++c)
        most = std::max(most, std::abs(shown[0][4 * i + c] - shown[1][4 * i + c]));
      off += most > 1.0f / 255.0f ? 1 : 0;
      offMasks += masks[0][i] != masks[1][i] ? 1 : 0;
    }
    std::printf("%s: %d samples, %d differ, masks %d\n", options, samples, off, offMasks);
    EXPECT_GT(samples, 500);
    EXPECT_LE(off, samples / 200) << options;
    EXPECT_LE(offMasks, samples / 200) << options;
    for (const char* counter : {"environment", "second_order", "intersections"})
      EXPECT_NEAR(static_cast<double>(outputs[0].counters.at(counter)),
                  static_cast<double>(outputs[1].counters.at(counter)),
                  0.005 * static_cast<double>(outputs[0].counters.at(counter)) + 2.0)
          << counter;
  }
}

/// Whether all that a method has shown on reflectors is finite, and how many samples there are.
int finiteSamples(const test::GlStage& stage) {
  const std::vector<float> shown = raster::readRgba(stage.gbuffer.reflection);
  const std::vector<std::uint32_t> ids = raster::readIds(stage.gbuffer.object);
  int samples = 0;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    if (ids[i] == 0) continue;
    ++samples;
    for (std::size_t c = 0; c < 3; ++c) EXPECT_TRUE(std::isfinite(shown[4 * i + c])) << i;
  }
  return samples;
}

TEST(Billboards, BallsInsideTouchingAndAboutTheCentreAreShown) {
  for (const char* unit : {"device", "processor"}) {
    // Inside, touching from without, about the same centre, and apart
    for (const auto& [radius, x] :
         {std::pair{0.15f, 0.1f}, {0.3f, 0.7f}, {0.2f, 0.0f}, {0.3f, 2.0f}}) {
      test::SceneBuilder builder;
      builder.constantEnvironment(Vec3(0.25f));
      builder.add(scene::makeSphere(0.4f, 64, 32, scene::UvMode::Unit), builder.reflective(0.9f));
      builder.add(scene::makeSphere(radius, 64, 32, scene::UvMode::Unit), unlit(builder),
                  test::translation({x, 0.0f, 0.0f}));
      test::GlStage stage(builder.scene(), kSettings);
      test::GlMethod method(stage, billboardsEntry(), with(R"("objects": ["object1"])", unit));
      const FrameOutput output = method.render(cameraAt({0.3f, 0.9f, 2.2f}));
      EXPECT_GT(finiteSamples(stage), 300);
      // One about the reflector's centroid stays in the map
      EXPECT_EQ(output.counters.at("enclosing"), x < radius ? 1u : 0u) << unit << x;
    }
  }
}

TEST(Billboards, FiveHundredReflectorsAreFilled) {
  test::SceneBuilder builder;
  builder.constantEnvironment(Vec3(0.25f));
  const int material = builder.reflective(0.9f);
  for (int i = 0; i < 500; ++i) {
    const int row = i / 25;
    builder.add(scene::makeSphere(0.05f, 8, 4, scene::UvMode::Unit), material,
                test::translation({0.12f * static_cast<float>(i % 25 - 12),
                                   0.12f * static_cast<float>(row - 10), 0.0f}));
  }
  builder.add(coloured({4.0f, 4.0f}), unlit(builder), test::translation({0.0f, -1.4f, 0.0f}));
  test::GlStage stage(builder.scene(), kSettings);
  test::GlMethod method(stage, billboardsEntry(),
                        R"({"texture_size": 16, "face_size": 64, "objects": ["object500"]})");
  const FrameOutput output = method.render(cameraAt({0.3f, 0.5f, 4.5f}));
  EXPECT_GT(finiteSamples(stage), 500);
  // One image of the floor for all
  EXPECT_EQ(output.counters.at("impostors_rendered"), 1u);
}

}  // namespace
}  // namespace catoptric::methods
