// Lobes against what is known of them.
#include "methods/glossy_lod/glossy_lod.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "frame/test_scenes.h"
#include "methods/glossy_lod/image_layers.h"
#include "methods/glossy_lod/scene_images.h"
#include "methods/testing/gl_harness.h"
#include "scene/loader.h"

namespace catoptric::methods {
namespace {

using namespace glossy_lod;
using test::SceneBuilder;

/// A glossy mirror on the ground, and a camera that sees one place of it under 45 degrees.
struct LobeBench {
  static constexpr float kG = 0.42f;
  SceneBuilder builder;
  scene::Camera camera = scene::lookAt({0.0f, 1.0f, 1.0f}, Vec3(0.0f), {0, 1, 0}, 0.002f);

  LobeBench() {
    builder.add(scene::makePlane(Vec2(4.0f), {1, 1}, scene::UvMode::Unit),
                builder.reflective(1.0f, kG));
    builder.constantEnvironment(Vec3(0.0f));
  }
  /// The mean over the frame of what the lobe sees.
  double seen(const std::string& options) {
    test::GlStage stage(builder.scene(), test::framesOf(16, 16, 1));
    test::GlMethod method(stage, glossyLodEntry(), options);
    method.render(camera);
    const std::vector<float> values = raster::readRgba(stage.gbuffer.reflection);
    double sum = 0.0;
    for (std::size_t i = 0; i < values.size(); i += 4) sum += static_cast<double>(values[i]);
    return 4.0 * sum / static_cast<double>(values.size());
  }
};

TEST(LobeSlots, DifferForAllShiftsOfSamples) {
  for (const float lobe : {0.0f, 0.3f, 2.0f}) {
    std::set<std::size_t> slots;
    for (int at = 0; at < 64; ++at) slots.insert(trace::lobeSlot(lobe, lobeShift(at % 8, at / 8)));
    EXPECT_EQ(slots.size(), 64u) << lobe;
  }
}

TEST(GlossyLod, SeesOfASphereItsShareOfTheLobe) {
  LobeBench bench;
  const float angle = 0.2f;
  const Vec3 mirror = glm::normalize(Vec3(0.0f, 1.0f, -1.0f));
  bench.builder.add(scene::makeIcosphere(3.0f * std::sin(angle), 5, scene::UvMode::Unit),
                    bench.builder.diffuse(Vec3(0.0f), Vec3(1.0f)),
                    test::translation(3.0f * mirror));
  const double n = static_cast<double>(scene::phongExponentFromRoughness(LobeBench::kG));
  const double share = 1.0 - std::pow(std::cos(static_cast<double>(angle)), n + 1.0);
  EXPECT_GT(share, 0.5);
  EXPECT_LT(share, 0.9);
  for (const char* alpha : {"0", "1", "3"})
    EXPECT_NEAR(bench.seen(std::string(R"({"rays": 160, "alpha": )") + alpha + "}"), share, 0.015)
        << alpha;
}

TEST(GlossyLod, SeesInAMirrorWhatStandsBesideIt) {
  LobeBench bench;
  const float angle = 0.2f;
  const Vec3 axis = glm::normalize(Vec3(0.0f, 1.0f, -1.0f));
  // The mirror turns the axis to the right, and the way to the sphere is 3 m long
  const Vec3 normal = glm::normalize(Vec3(1, 0, 0) - axis);
  const Mat4 turn = test::rotation(120.0f, glm::cross(Vec3(0, 1, 0), normal));
  bench.builder.add(scene::makePlane(Vec2(6.0f), {1, 1}, scene::UvMode::Unit),
                    bench.builder.reflective(1.0f), test::translation(1.5f * axis) * turn);
  bench.builder.add(scene::makeIcosphere(3.0f * std::sin(angle), 5, scene::UvMode::Unit),
                    bench.builder.diffuse(Vec3(0.0f), Vec3(1.0f)),
                    test::translation(1.5f * axis + Vec3(1.5f, 0.0f, 0.0f)));
  const double n = static_cast<double>(scene::phongExponentFromRoughness(LobeBench::kG));
  const double share = 1.0 - std::pow(std::cos(static_cast<double>(angle)), n + 1.0);
  for (const char* alpha : {"0", "3"}) {
    const std::string options = std::string(R"({"rays": 160, "alpha": )") + alpha;
    EXPECT_NEAR(bench.seen(options + R"(, "bounces": 2})"), share, 0.015) << alpha;
    EXPECT_NEAR(bench.seen(options + "}"), 0.0, 0.01) << alpha;
  }
}

TEST(GlossyLod, SeesHalfOfAnEdgeThroughTheAxis) {
  LobeBench bench;
  // A wide sheet across the mirrored axis that ends at it, to the right
  const Mat4 place = test::translation({10.0f, 2.0f, -2.0f}) * test::rotation(-45.0f, {1, 0, 0});
  bench.builder.add(scene::makePlane(Vec2(20.0f), {8, 8}, scene::UvMode::Unit),
                    bench.builder.diffuse(Vec3(0.0f), Vec3(1.0f)), place);
  for (const char* alpha : {"0", "3"})
    EXPECT_NEAR(bench.seen(std::string(R"({"rays": 160, "alpha": )") + alpha + "}"), 0.5, 0.02);
}

TEST(GlossyLod, ShowsItsImagesAsLayers) {
  // A square is not distorted, one of 2 x 1 by half, nor is a line less than wholly
  EXPECT_NEAR(distortion({0, 0, 3}, {0, 3, 0}), 0.0f, 1e-6f);
  EXPECT_NEAR(distortion({2, 0, 0}, {0, 1, 0}), 0.5f, 1e-6f);
  EXPECT_NEAR(distortion({1, 0, 0}, {2, 0, 0}), 1.0f, 1e-3f);
  SceneBuilder builder;
  builder.add(scene::makeIcosphere(1.0f, 5, scene::UvMode::Unit), builder.diffuse(Vec3(0.5f)));
  test::GlStage stage(builder.scene(), test::framesOf(40, 30, 1));
  SceneImages images;
  images.make(stage.scene, stage.moment.geometry, {}, findSizes(stage.scene, {}, {.size = 64}));
  EXPECT_GE(images.counts().meanStretchPercent, 100u);
  EXPECT_LT(images.counts().mostStretchPercent, 300u);
  const scene::Camera camera = scene::lookAt({0.0f, 0.0f, 3.0f}, Vec3(0.0f), {0, 1, 0}, 1.0f);
  std::vector<SampleLayer> layers;
  showImages(images, camera, 40, 30, {"Z"}, layers);
  EXPECT_TRUE(layers.empty());
  showImages(images, camera, 40, 30, {"chart", "image_position", "image_normal", "image_place"},
             layers);
  ASSERT_EQ(layers.size(), 4u);
  const Mat3 rayFromPixel = scene::rayFromPixel(camera, 40, 30);
  int seen = 0;
  float across = 0.0f;
  for (std::size_t i = 0; i < 40 * 30; ++i) {
    const std::size_t row = i / 40;
    const Vec3 pixel(static_cast<float>(i % 40) + 0.5f, static_cast<float>(row) + 0.5f, 1.0f);
    const Vec3 way = glm::normalize(rayFromPixel * pixel);
    const float apart = glm::length(glm::cross(camera.eye(), way));
    if (std::abs(apart - 1.0f) > 0.02f) {
      EXPECT_EQ(layers[0].numbers[i] > 0, apart < 1.0f) << i;
    }
    if (layers[0].numbers[i] == 0) continue;
    ++seen;
    EXPECT_LE(layers[0].numbers[i], images.charts().size());
    EXPECT_NEAR(glm::length(layers[1].vectors[i]), 1.0f, 0.05f);
    EXPECT_LT(glm::length(glm::cross(layers[1].vectors[i] - camera.eye(), way)), 1e-4f);
    across += glm::dot(layers[2].vectors[i], glm::normalize(layers[1].vectors[i]));
    const Vec3 place = layers[3].vectors[i];
    EXPECT_TRUE(place.x >= 0.0f && place.x <= 1.0f && place.y >= 0.0f && place.y <= 1.0f);
    EXPECT_TRUE(place.z >= 0.0f && place.z <= 1.0f);
  }
  EXPECT_GT(seen, 200);
  EXPECT_GT(across, 0.99f * static_cast<float>(seen));
}

TEST(GlossyLod, IsWhiteInAWhiteFurnaceAtAnyAlpha) {
  LobeBench bench;
  bench.builder.constantEnvironment(Vec3(1.0f));
  bench.builder.add(scene::makeTorus(0.5f, 0.2f, 40, 20, scene::UvMode::Unit),
                    bench.builder.diffuse(Vec3(0.0f), Vec3(1.0f)),
                    test::translation({0.0f, 1.0f, -1.0f}));
  for (const char* options :
       {R"({"alpha": 0})", R"({"alpha": 1})", R"({"alpha": 10})", R"({"alpha": 1000})",
        R"({"filter": false})", R"({"rays": 40})", R"({"automatic": true})"})
    EXPECT_EQ(bench.seen(options), 1.0) << options;
}

TEST(GlossyLod, IsWhiteInAWhiteFurnaceAfterManyBounces) {
  LobeBench bench;
  bench.builder.constantEnvironment(Vec3(1.0f));
  for (const float g : {0.0f, 0.3f})
    bench.builder.add(scene::makeIcosphere(0.5f, 4, scene::UvMode::Unit),
                      bench.builder.reflective(1.0f, g),
                      test::translation({4.0f * g, 1.0f, -1.0f}));
  EXPECT_LT(bench.seen(R"({"bounces": 1})"), 0.9);
  EXPECT_NEAR(bench.seen(R"({"bounces": 16})"), 1.0, 0.01);
}

TEST(GlossyLod, AtAlphaZeroIsThePlainTracer) {
  test::GlStage stage(
      scene::loadScene(std::string(CATOPTRIC_SOURCE_DIR) + "/scenes/nine_spheres.json"),
      test::framesOf(96, 96, 1));
  const scene::Camera camera =
      scene::lookAt({1.0f, 1.8f, 5.0f}, {0.0f, 0.6f, 0.0f}, {0, 1, 0}, 0.7f);
  std::vector<std::vector<float>> frames;
  for (const char* options :
       {R"({"objects": "all", "levels": "off"})", R"({"objects": "all", "alpha": 0})"}) {
    test::GlMethod method(stage, glossyLodEntry(), options);
    const FrameOutput output = method.render(camera);
    EXPECT_GT(output.counters.at("quads_tested"), 1000u);
    EXPECT_EQ(output.counters.at("stopped"), 0u);
    frames.push_back(raster::readRgba(stage.gbuffer.reflection));
  }
  EXPECT_EQ(frames[0], frames[1]);
}

}  // namespace
}  // namespace catoptric::methods
