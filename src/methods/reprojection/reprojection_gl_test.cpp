// Whole frames against the method's definition: what it traces has `traced`'s bits, what stands
// still keeps its own.
#include "methods/reprojection/reprojection.h"

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "methods/testing/gl_harness.h"
#include "scene/loader.h"

namespace catoptric::methods {
namespace {

scene::Scene sceneOf(const std::string& name) {
  return scene::loadScene(std::string(CATOPTRIC_SOURCE_DIR) + "/scenes/" + name + ".json");
}

scene::Camera spheresFrom(const Vec3& eye) {
  return scene::lookAt(eye, {0.0f, 0.6f, 0.0f}, {0.0f, 1.0f, 0.0f}, 0.7f);
}
const Vec3 kEye(1.0f, 1.8f, 5.0f);

int samplesThat(const test::TracedSamples& samples, const std::vector<std::uint16_t>& masks,
                bool retraced, const std::vector<Vec3>& as) {
  int different = 0;
  for (std::size_t i = 0; i < samples.places.size(); ++i) {
    const bool wasRetraced = (masks[samples.places[i]] & raster::kMaskRetraced) != 0;
    if (wasRetraced == retraced && samples.ours[i] != as[i]) ++different;
  }
  return different;
}

TEST(Reprojection, IsTracedWhereEveryFrameIsAKeyFrame) {
  test::GlStage stage(sceneOf("nine_spheres"), test::framesOf(96, 96, 2));
  for (const MethodEntry* entry : {&reprojectionEntry(), &imageWarpEntry()}) {
    test::GlMethod method(stage, *entry, R"({"keyframe_every": 1, "rays": 1})");
    for (int frame = 0; frame < 3; ++frame) {
      const auto camera = spheresFrom(kEye + Vec3(0.2f * static_cast<float>(frame), 0.0f, 0.0f));
      method.render(camera);
      const test::TracedSamples samples(stage, camera, {});
      EXPECT_GT(samples.places.size(), 3000u);
      EXPECT_EQ(samples.ours, samples.traced);
    }
  }
}

TEST(Reprojection, FindsMostAndTracesTheRest) {
  test::GlStage stage(sceneOf("planar_mirror"), test::framesOf(192, 192, 1, true));
  const Vec3 eye(0.3f, 1.35f, 1.2f);
  const auto from = [&](const Vec3& at) {
    return scene::lookAt(at, {0.0f, 1.0f, -2.0f}, {0.0f, 1.0f, 0.0f}, 0.8f);
  };
  const auto camera = from(eye + Vec3(0.05f, 0.01f, -0.03f));
  double warpedError = 0.0;
  for (const MethodEntry* entry : {&imageWarpEntry(), &reprojectionEntry()}) {
    test::GlMethod method(stage, *entry, R"({"keyframe_threshold": 1})");
    method.render(from(eye));
    const FrameOutput output = method.render(camera);
    EXPECT_EQ(output.counters.at("key_frame"), 0u);
    const test::TracedSamples samples(stage, camera, {});
    const auto masks = raster::readMasks(stage.gbuffer.masks);
    EXPECT_EQ(samplesThat(samples, masks, true, samples.traced), 0) << entry->id;
    EXPECT_EQ(output.counters.at("reused") + output.counters.at("retraced"), samples.places.size());
    EXPECT_GT(output.counters.at("reused"), 2 * output.counters.at("retraced"));
    EXPECT_TRUE(samples.finite());
    if (entry->id == "image_warp") {
      warpedError = samples.l1Of8Bit();
    } else {
      EXPECT_LT(samples.l1Of8Bit(), 0.5 * warpedError);
    }
  }
}

TEST(Reprojection, GoesOverSmoothlyAtTheBorderOfWhatIsTraced) {
  test::GlStage stage(sceneOf("planar_mirror"), test::framesOf(192, 192, 1, true));
  const auto from = [](const Vec3& at) {
    return scene::lookAt(at, {0.0f, 1.0f, -2.0f}, {0.0f, 1.0f, 0.0f}, 0.8f);
  };
  const auto camera = from({0.35f, 1.36f, 1.17f});
  std::array<double, 2> error{};
  std::array<std::uint64_t, 2> retraced{};
  for (const int border : {0, 3}) {
    test::GlMethod method(stage, reprojectionEntry(),
                          R"({"keyframe_threshold": 1, "border": )" + std::to_string(border) + "}");
    method.render(from({0.3f, 1.35f, 1.2f}));
    const FrameOutput output = method.render(camera);
    const test::TracedSamples samples(stage, camera, {});
    const auto masks = raster::readMasks(stage.gbuffer.masks);
    EXPECT_EQ(samplesThat(samples, masks, true, samples.traced), 0);
    EXPECT_EQ(output.counters.at("reused") + output.counters.at("retraced"), samples.places.size());
    EXPECT_EQ(output.counters.at("rays"),
              output.counters.at("retraced") + output.counters.at("blended"));
    EXPECT_EQ(output.counters.at("blended") > 0, border > 0);
    error[border > 0 ? 1 : 0] = samples.l1Of8Bit();
    retraced[border > 0 ? 1 : 0] = output.counters.at("retraced");
  }
  EXPECT_EQ(retraced[0], retraced[1]);
  EXPECT_LT(error[1], error[0]);
}

TEST(Reprojection, FindsMostByThePapersGrids) {
  test::GlStage stage(sceneOf("planar_mirror"), test::framesOf(192, 192, 1, true));
  const auto from = [](const Vec3& at) {
    return scene::lookAt(at, {0.0f, 1.0f, -2.0f}, {0.0f, 1.0f, 0.0f}, 0.8f);
  };
  test::GlMethod method(stage, reprojectionEntry(),
                        R"({"keyframe_threshold": 1, "mapping": "grid"})");
  method.render(from({0.3f, 1.35f, 1.2f}));
  const std::vector<float> before = raster::readRgba(stage.gbuffer.reflection);
  FrameOutput output = method.render(from({0.3f, 1.35f, 1.2f}));
  EXPECT_EQ(raster::readRgba(stage.gbuffer.reflection), before);
  const auto camera = from({0.35f, 1.36f, 1.17f});
  output = method.render(camera);
  const test::TracedSamples samples(stage, camera, {});
  const auto masks = raster::readMasks(stage.gbuffer.masks);
  EXPECT_EQ(samplesThat(samples, masks, true, samples.traced), 0);
  EXPECT_GT(output.counters.at("reused"), 2 * output.counters.at("retraced"));
  EXPECT_LT(samples.l1Of8Bit(), 3.0);
  RecordProperty("l1", std::to_string(samples.l1Of8Bit()));
}

// [Xie2017] Fig. 5: where the camera comes nearer, holes open between points but not in a mesh.
TEST(Reprojection, TearsWherePointsAreSplatted) {
  test::GlStage stage(sceneOf("planar_mirror"), test::framesOf(128, 128, 1, true));
  const auto from = [](float z) {
    return scene::lookAt({0.0f, 1.3f, z}, {0.0f, 1.0f, -2.0f}, {0.0f, 1.0f, 0.0f}, 0.8f);
  };
  std::vector<std::uint64_t> missing;
  for (const char* mapping : {"grid", "splat"}) {
    test::GlMethod method(
        stage, reprojectionEntry(),
        std::string(R"({"keyframe_threshold": 1, "mapping": ")") + mapping + "\"}");
    method.render(from(1.2f));
    const std::vector<float> before = raster::readRgba(stage.gbuffer.reflection);
    method.render(from(1.2f));
    EXPECT_EQ(raster::readRgba(stage.gbuffer.reflection), before) << mapping;
    const auto output = method.render(from(0.4f));
    const test::TracedSamples samples(stage, from(0.4f), {});
    const auto masks = raster::readMasks(stage.gbuffer.masks);
    EXPECT_EQ(samplesThat(samples, masks, true, samples.traced), 0) << mapping;
    missing.push_back(output.counters.at("retraced"));
  }
  EXPECT_GT(missing[1], missing[0] + missing[0] / 4);
}

TEST(Reprojection, KeepsTheBytesOfWhatStandsStill) {
  test::GlStage stage(sceneOf("nine_spheres"), test::framesOf(96, 96, 1, true));
  for (const MethodEntry* entry : {&reprojectionEntry(), &imageWarpEntry()})
    for (const char* options :
         {R"({"keyframe_threshold": 1})", R"({"keyframe_threshold": 1, "bounces": 2})"}) {
      test::GlMethod method(stage, *entry, options);
      method.render(spheresFrom(kEye));
      const std::vector<float> before = raster::readRgba(stage.gbuffer.reflection);
      const FrameOutput output = method.render(spheresFrom(kEye));
      EXPECT_EQ(output.counters.at("key_frame"), 0u);
      // But samples without a neighbour that shows the same.
      EXPECT_LE(10 * output.counters.at("second_bounce"), output.counters.at("reused"));
      EXPECT_EQ(raster::readRgba(stage.gbuffer.reflection), before) << entry->id << options;
    }
}

TEST(Reprojection, EqualsImageWarpWhenTheCameraOnlyTurns) {
  test::GlStage stage(sceneOf("planar_mirror"), test::framesOf(128, 128, 1, true));
  const auto before = scene::lookAt({0.3f, 1.35f, 1.2f}, {0.0f, 1.0f, -2.0f}, {0, 1, 0}, 0.8f);
  const auto after = scene::lookAt({0.3f, 1.35f, 1.2f}, {0.06f, 1.04f, -2.0f}, {0, 1, 0}, 0.8f);
  std::vector<std::vector<Vec3>> ours;
  std::vector<std::vector<std::uint16_t>> masks;
  std::vector<std::uint32_t> places;
  for (const MethodEntry* entry : {&reprojectionEntry(), &imageWarpEntry()}) {
    test::GlMethod method(stage, *entry, R"({"keyframe_threshold": 1})");
    method.render(before);
    method.render(after);
    test::TracedSamples samples(stage, after, {});
    ours.push_back(std::move(samples.ours));
    masks.push_back(raster::readMasks(stage.gbuffer.masks));
    places = samples.places;
  }
  int both = 0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const auto reused = [&](const std::vector<std::uint16_t>& mask) {
      return (mask[places[i]] & raster::kMaskRetraced) == 0;
    };
    if (!reused(masks[0]) || !reused(masks[1])) continue;
    EXPECT_EQ(ours[0][i], ours[1][i]);
    ++both;
  }
  EXPECT_GT(both, 1000);
}

}  // namespace
}  // namespace catoptric::methods
