#include "methods/screen_space/screen_space.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <string>
#include <vector>

#include "frame/test_scenes.h"
#include "methods/testing/gl_harness.h"

namespace catoptric::methods {
namespace {

using test::rotation;
using test::translation;

constexpr int kWidth = 200;
constexpr int kHeight = 160;
constexpr std::uint32_t kMirror = 1;

/// A mirror on the ground, before a wall, with stripes or without, with a pillar; the camera sees
/// what is reflected. `wallLevel`: s of the wall.
scene::Scene hall(float roughness = 0.0f, int stripes = 0, float wallLevel = 0.0f) {
  test::SceneBuilder builder;
  builder.constantEnvironment(Vec3(0.5f, 0.6f, 0.9f));
  builder.add(scene::makePlane({4.0f, 4.0f}, {1, 1}, scene::UvMode::Unit),
              builder.reflective(0.8f, roughness));
  builder.add(scene::makePlane({8.0f, 8.0f}, {1, 1}, scene::UvMode::Unit),
              builder.reflective(wallLevel, 0.0f, Vec3(0.7f, 0.3f, 0.2f)),
              translation({0.0f, 4.0f, -2.0f}) * rotation(90.0f, {1.0f, 0.0f, 0.0f}));
  builder.add(scene::makeBox({}, scene::UvMode::Unit), builder.diffuse(Vec3(0.1f, 0.6f, 0.3f)),
              translation({0.4f, 0.5f, -1.0f}) * glm::scale(Mat4(1.0f), Vec3(0.4f, 1.0f, 0.4f)));
  for (int i = 0; i < stripes; ++i)
    builder.add(
        scene::makePlane({8.0f, 2.0f / static_cast<float>(stripes)}, {1, 1}, scene::UvMode::Unit),
        builder.diffuse(Vec3(0.1f, 0.1f, 0.7f)),
        translation(
            {0.0f, (static_cast<float>(i) + 0.25f) * 4.0f / static_cast<float>(stripes), -1.99f}) *
            rotation(90.0f, {1.0f, 0.0f, 0.0f}));
  return builder.scene();
}

scene::Camera camera() {
  return scene::lookAt({0.0f, 1.0f, 3.0f}, {0.0f, 0.6f, -2.0f}, {0.0f, 1.0f, 0.0f}, 1.0f);
}

struct Frame {
  std::vector<float> reflection;
  std::vector<std::uint32_t> ids;
  std::vector<std::uint16_t> masks;
  Counters counters;
};

Frame frameOf(const std::string& method, const std::string& options, float roughness = 0.0f,
              int stripes = 0, float wallLevel = 0.0f) {
  test::GlStage stage(hall(roughness, stripes, wallLevel),
                      test::framesOf(kWidth, kHeight, 1, true));
  Frame frame;
  frame.counters =
      test::GlMethod(stage, test::methodNamed(method), options).render(camera()).counters;
  frame.reflection = raster::readRgba(stage.gbuffer.reflection);
  frame.ids = raster::readIds(stage.gbuffer.object);
  frame.masks = raster::readMasks(stage.gbuffer.masks);
  return frame;
}

constexpr std::uint16_t kMisses = raster::kMaskOffscreen | raster::kMaskBehind |
                                  raster::kMaskBackface | raster::kMaskTowardCamera |
                                  raster::kMaskSteps;

float differenceAt(const Frame& a, const Frame& b, std::size_t i) {
  float worst = 0.0f;
  for (std::size_t c = 0; c < 3; ++c)
    worst = std::max(worst, std::abs(a.reflection[4 * i + c] - b.reflection[4 * i + c]));
  return worst;
}

TEST(ScreenSpace, SeesWhatRaysMeetWhereTheFrameShowsIt) {
  const Frame traced = frameOf("traced", "{}");
  for (const char* trace : {"hi_z", "dda"}) {
    const Frame frame = frameOf(
        "screen_space", "{\"fallback\": \"black\", \"trace\": \"" + std::string(trace) + "\"}");
    int found = 0;
    int missed = 0;
    int different = 0;
    for (std::size_t i = 0; i < frame.ids.size(); ++i) {
      if (frame.ids[i] != kMirror) continue;
      if ((frame.masks[i] & kMisses) != 0) {
        ++missed;
        EXPECT_EQ(frame.reflection[4 * i], 0.0f);
        continue;
      }
      ++found;
      different += differenceAt(frame, traced, i) > 0.02f ? 1 : 0;
    }
    EXPECT_GT(found, 5000) << trace;
    EXPECT_GT(missed, 100) << trace;
    // Outlines of the pillar
    EXPECT_LT(different, found / 50) << trace;
  }
}

TEST(ScreenSpace, BothWaysToFollowARayMeetTheSame) {
  const Frame coarse = frameOf("screen_space", R"({"fallback": "black"})");
  const Frame fine = frameOf("screen_space", R"({"fallback": "black", "trace": "dda"})");
  int samples = 0;
  int different = 0;
  for (std::size_t i = 0; i < coarse.ids.size(); ++i) {
    if (coarse.ids[i] != kMirror) continue;
    ++samples;
    different += differenceAt(coarse, fine, i) > 1e-3f ? 1 : 0;
  }
  EXPECT_LE(different, samples / 1000);
}

// A binary search finds the place within a long step: borders of stripes stay where they are.
TEST(ScreenSpace, LongStepsAreRefined) {
  const auto seen = [](const char* stride) {
    return frameOf(
        "screen_space",
        R"({"fallback": "black", "trace": "dda", "stride": )" + std::string(stride) + "}", 0.0f, 8);
  };
  const Frame fine = seen("1");
  const Frame steps = seen("8");
  int samples = 0;
  int different = 0;
  for (std::size_t i = 0; i < fine.ids.size(); ++i) {
    if (fine.ids[i] != kMirror) continue;
    ++samples;
    different += differenceAt(steps, fine, i) > 0.02f ? 1 : 0;
  }
  EXPECT_LT(different, samples / 10);
}

// Means over the samples of a glossy mirror whose rays, and whose cone, all find something.
TEST(ScreenSpace, AConeHasTheEnergyOfItsRays) {
  for (const int stripes : {0, 8}) {
    const Frame rays =
        frameOf("screen_space", R"({"fallback": "black", "rays": 64})", 0.2f, stripes);
    const Frame cone = frameOf(
        "screen_space", R"({"fallback": "black", "rays": 64, "glossy": "cone"})", 0.2f, stripes);
    Vec3 ofRays(0.0f);
    Vec3 ofCones(0.0f);
    int samples = 0;
    for (std::size_t i = 0; i < rays.ids.size(); ++i) {
      if (rays.ids[i] != kMirror || ((rays.masks[i] | cone.masks[i]) & kMisses) != 0) continue;
      ++samples;
      ofRays +=
          Vec3(rays.reflection[4 * i], rays.reflection[4 * i + 1], rays.reflection[4 * i + 2]);
      ofCones +=
          Vec3(cone.reflection[4 * i], cone.reflection[4 * i + 1], cone.reflection[4 * i + 2]);
    }
    EXPECT_GT(samples, 2000);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(ofCones[c] / ofRays[c], 1.0f, 0.02f) << c;
    EXPECT_EQ(cone.counters.at("cones"), cone.counters.at("samples"));
    EXPECT_EQ(rays.counters.at("cones"), 0u);
  }
}

TEST(ScreenSpace, EachRayEndsOnceAndItsSampleIsMarked) {
  for (const float roughness : {0.0f, 0.3f}) {
    const Frame frame = frameOf("screen_space", R"({"fallback": "black", "rays": 4})", roughness);
    std::uint64_t ends = 0;
    for (const char* end :
         {"hits", "sky", "offscreen", "behind", "backface", "toward_camera", "steps"})
      ends += frame.counters.at(end);
    const std::uint64_t rays = roughness > 0.0f ? 4 : 1;
    EXPECT_EQ(ends, rays * frame.counters.at("samples"));
    if (rays > 1) continue;
    std::uint64_t notFound = 0;
    for (std::size_t i = 0; i < frame.ids.size(); ++i)
      if (frame.ids[i] == kMirror) {
        EXPECT_LE(
            std::popcount(static_cast<unsigned>(frame.masks[i] & (kMisses | raster::kMaskSky))), 1);
        notFound += (frame.masks[i] & kMisses) != 0 ? 1 : 0;
      }
    EXPECT_EQ(notFound, ends - frame.counters.at("hits") - frame.counters.at("sky"));
    for (const auto& [bit, end] :
         {std::pair(raster::kMaskOffscreen, "offscreen"), std::pair(raster::kMaskBehind, "behind"),
          std::pair(raster::kMaskSky, "sky")}) {
      std::uint64_t marked = 0;
      for (const std::uint16_t mask : frame.masks) marked += (mask & bit) != 0 ? 1 : 0;
      EXPECT_EQ(marked, frame.counters.at(end)) << end;
    }
  }
}

TEST(ScreenSpace, ASampleWithAMissIsTracedAsByTraced) {
  for (const float roughness : {0.0f, 0.3f}) {
    const Frame traced = frameOf("traced", "{}", roughness);
    const Frame frame = frameOf("screen_space", R"({"fallback": "traced"})", roughness);
    std::uint64_t retraced = 0;
    for (std::size_t i = 0; i < frame.ids.size(); ++i) {
      if (frame.ids[i] != kMirror || (frame.masks[i] & kMisses) == 0) continue;
      ++retraced;
      EXPECT_NE(frame.masks[i] & raster::kMaskRetraced, 0);
      ASSERT_EQ(differenceAt(frame, traced, i), 0.0f);
    }
    EXPECT_GT(retraced, 100u);
    EXPECT_EQ(retraced, frame.counters.at("retraced"));
  }
}

// The diffuse radiance of the wall is taken, which is no miss: as `traced` does with one bounce.
TEST(ScreenSpace, HitsOnOtherReflectorsAreMarked) {
  EXPECT_EQ(frameOf("screen_space", "{}").counters.at("view_colour"), 0u);
  const Frame traced = frameOf("traced", "{}", 0.0f, 0, 0.5f);
  for (const char* options : {R"({"trace": "hi_z"})", R"({"trace": "dda"})"}) {
    const Frame frame = frameOf("screen_space", options, 0.0f, 0, 0.5f);
    std::uint64_t marked = 0;
    int onWall = 0;
    int different = 0;
    for (std::size_t i = 0; i < frame.ids.size(); ++i) {
      const bool marks = (frame.masks[i] & raster::kMaskViewColour) != 0;
      marked += marks ? 1 : 0;
      ASSERT_FALSE(marks && (frame.masks[i] & (kMisses | raster::kMaskSky)) != 0);
      if (frame.ids[i] != kMirror || (frame.masks[i] & (kMisses | raster::kMaskSky)) != 0) continue;
      // The wall is red, the pillar green
      ASSERT_EQ(marks, frame.reflection[4 * i] > frame.reflection[4 * i + 1]);
      onWall += marks ? 1 : 0;
      different += marks && differenceAt(frame, traced, i) > 0.02f ? 1 : 0;
    }
    EXPECT_EQ(marked, frame.counters.at("view_colour"));
    EXPECT_GT(onWall, 3000);
    EXPECT_LT(different, onWall / 50);
  }
}

// Each ray of a lobe is checked: samples that Embree does not object to look as by `traced`.
TEST(ScreenSpace, EmbreeChecksTheRaysOfLobes) {
  RunSettings settings = test::framesOf(kWidth, kHeight, 1, true);
  settings.countDisocclusions = true;
  for (const int rays : {1, 4}) {
    const std::string options = "\"rays\": " + std::to_string(rays) + "}";
    const Frame traced = frameOf("traced", "{" + options, 0.3f);
    test::GlStage stage(hall(0.3f), settings);
    test::GlMethod method(stage, screenSpaceEntry(), R"({"fallback": "black", )" + options);
    // Ends of an earlier frame do not remain
    method.render(scene::lookAt({0.0f, 3.0f, 3.0f}, Vec3(0.0f), {0.0f, 1.0f, 0.0f}, 0.5f));
    const Counters counters = method.render(camera()).counters;
    Frame frame;
    frame.reflection = raster::readRgba(stage.gbuffer.reflection);
    const std::vector<std::uint16_t> masks = raster::readMasks(stage.gbuffer.masks);
    int agreed = 0;
    int unlike = 0;
    for (std::size_t i = 0; i < masks.size(); ++i) {
      if (traced.ids[i] != kMirror || (masks[i] & (kMisses | raster::kMaskDisoccluded)) != 0)
        continue;
      ++agreed;
      unlike += differenceAt(frame, traced, i) > 0.02f ? 1 : 0;
    }
    EXPECT_GT(agreed, 1000);
    EXPECT_LT(unlike, agreed / 50);
    EXPECT_GT(counters.at("disoccluded"), 100u);
    EXPECT_GT(counters.at("wrong_hit"), 0u);
    EXPECT_LT(counters.at("wrong_hit"), counters.at("hits") / 20);
    EXPECT_LE(counters.at("hits") + counters.at("disoccluded"),
              static_cast<std::uint64_t>(rays) * counters.at("samples"));
  }
}

// The cone of a narrow lobe is checked along its mirrored ray.
TEST(ScreenSpace, EmbreeChecksCones) {
  RunSettings settings = test::framesOf(kWidth, kHeight, 1);
  settings.countDisocclusions = true;
  std::vector<Counters> counters;
  for (const float roughness : {0.0f, 0.06f}) {
    test::GlStage stage(hall(roughness), settings);
    counters.push_back(test::GlMethod(stage, screenSpaceEntry(), R"({"glossy": "cone"})")
                           .render(camera())
                           .counters);
  }
  for (const char* count : {"disoccluded", "wrong_hit", "missed_hit"})
    EXPECT_NEAR(static_cast<double>(counters[0].at(count)),
                static_cast<double>(counters[1].at(count)),
                0.05 * static_cast<double>(counters[0].at(count)) + 20.0)
        << count;
}

TEST(ScreenSpace, EmbreeTellsWhichHitsAreWrong) {
  const Frame traced = frameOf("traced", "{}");
  std::uint64_t missedHits[2] = {};
  for (const bool thin : {false, true}) {
    RunSettings settings = test::framesOf(kWidth, kHeight, 1, true);
    settings.countDisocclusions = true;
    test::GlStage stage(hall(), settings);
    const Counters counters = test::GlMethod(stage, screenSpaceEntry(),
                                             thin ? R"({"fallback": "black", "thickness": 0})"
                                                  : R"({"fallback": "black"})")
                                  .render(camera())
                                  .counters;
    Frame frame;
    frame.reflection = raster::readRgba(stage.gbuffer.reflection);
    const std::vector<std::uint32_t> ids = raster::readIds(stage.gbuffer.object);
    const std::vector<std::uint16_t> masks = raster::readMasks(stage.gbuffer.masks);
    std::uint64_t marked = 0;
    std::uint64_t missed = 0;
    std::uint64_t unlike = 0;
    for (std::size_t i = 0; i < ids.size(); ++i) {
      const bool objected = (masks[i] & raster::kMaskDisoccluded) != 0;
      marked += objected ? 1 : 0;
      missed += objected && (masks[i] & (kMisses | raster::kMaskSky)) != 0 ? 1 : 0;
      if (ids[i] == kMirror && !objected && (masks[i] & kMisses) == 0)
        unlike += differenceAt(frame, traced, i) > 0.02f ? 1 : 0;
    }
    missedHits[thin ? 1 : 0] = counters.at("missed_hit");
    EXPECT_EQ(marked, counters.at("disoccluded") + counters.at("wrong_hit"));
    EXPECT_EQ(missed, counters.at("disoccluded"));
    EXPECT_GT(missed, 100u);
    EXPECT_LT(unlike, 30u);
  }
  EXPECT_EQ(missedHits[0], 0u);
  EXPECT_GT(missedHits[1], 100u);
}

// A ray that grazes behind the pillar hits it if the pillar is taken to be thick.
TEST(ScreenSpace, ThicknessDecidesWhatPassesBehind) {
  const Frame thin = frameOf("screen_space", R"({"thickness": 0})");
  const Frame thick = frameOf("screen_space", R"({"thickness": 10})");
  EXPECT_GT(thin.counters.at("behind"), thick.counters.at("behind"));
  EXPECT_EQ(thick.counters.at("behind"), 0u);
}

// Rays of a level camera go straight up and down the frame.
TEST(ScreenSpace, FollowsRaysAlongColumns) {
  const scene::Camera level =
      scene::lookAt({0.0f, 1.0f, 3.0f}, {0.0f, 1.0f, -2.0f}, {0.0f, 1.0f, 0.0f}, 1.0f);
  std::uint64_t hits[2] = {};
  for (const bool dda : {false, true}) {
    test::GlStage stage(hall(), test::framesOf(65, 64, 1));
    const std::string options = dda ? R"({"trace": "dda"})" : "{}";
    const FrameOutput output = test::GlMethod(stage, screenSpaceEntry(), options).render(level);
    EXPECT_EQ(output.counters.at("steps"), 0u);
    hits[dda ? 1 : 0] = output.counters.at("hits");
  }
  EXPECT_GT(hits[0], 500u);
  EXPECT_NEAR(static_cast<double>(hits[0]), static_cast<double>(hits[1]),
              0.02 * static_cast<double>(hits[1]));
}

TEST(ScreenSpace, StepsAreBounded) {
  const Frame few = frameOf("screen_space", R"({"max_steps": 4})");
  EXPECT_GT(few.counters.at("steps"), few.counters.at("samples") / 2);
  const Frame enough = frameOf("screen_space", "{}");
  EXPECT_EQ(enough.counters.at("steps"), 0u);
}

}  // namespace
}  // namespace catoptric::methods
