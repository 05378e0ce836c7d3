// Whole frames against the method's definition: what it traces has `traced`'s bits, what stands
// still keeps its own.
#include "methods/reprojection/reprojection.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "frame/test_scenes.h"
#include "methods/reprojection/mirror_samples.h"
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
/// The paper's control keeps reflections on their surfaces.
const std::array<std::string, 2> kMappings = {"gather", "surface"};
std::string with(const std::string& mapping, const std::string& options) {
  return R"({"mapping": ")" + mapping + "\", " + options + "}";
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

std::vector<std::size_t> samplesWith(const test::GlStage& stage, std::uint16_t mask) {
  const auto masks = raster::readMasks(stage.gbuffer.masks);
  std::vector<std::size_t> result;
  for (std::size_t at = 0; at < masks.size(); ++at)
    if ((masks[at] & mask) != 0) result.push_back(at);
  return result;
}

TEST(Reprojection, IsTracedWhereEveryFrameIsAKeyFrame) {
  test::GlStage stage(sceneOf("nine_spheres"), test::framesOf(96, 96, 2));
  for (const std::string& mapping : kMappings) {
    test::GlMethod method(stage, reprojectionEntry(),
                          with(mapping, R"("keyframe_every": 1, "rays": 1)"));
    for (int frame = 0; frame < 3; ++frame) {
      const auto camera = spheresFrom(kEye + Vec3(0.2f * static_cast<float>(frame), 0.0f, 0.0f));
      method.render(camera);
      const test::TracedSamples samples(stage, camera, {});
      EXPECT_GT(samples.places.size(), 3000u);
      EXPECT_EQ(samples.ours, samples.traced);
    }
  }
}

// What is traced anew has the rays beside it that `traced` has beside it.
TEST(Reprojection, TracesAnewInTracedsPackets) {
  test::GlStage stage(sceneOf("nine_spheres"), test::framesOf(96, 96, 2));
  const trace::TraceScene& trace = stage.embree();
  const auto camera = spheresFrom(kEye);
  stage.draw(camera);
  raster::GBufferCopy copy;
  raster::readBack(stage.gbuffer, true, copy);
  reprojection::MirrorSamples samples;
  samples.find(copy, camera, trace, {});
  std::vector<std::size_t> tileOf(samples.count());  // its first sample
  std::vector<Vec3> directions(samples.count());
  samples.eachTile([&](std::size_t first, trace::PointLanes& lanes) {
    for (std::size_t k = 0; k < lanes.count; ++k) {
      tileOf[first + k] = first;
      directions[first + k] = lanes.direction.at(k);
    }
  });
  for (const int bounces : {1, 2}) {
    std::vector<std::uint32_t> slots(samples.count(), 0);
    for (std::size_t i = 0; i < slots.size(); i += 37) slots[i] = static_cast<std::uint32_t>(i) + 1;
    std::atomic<std::size_t> seen = 0;
    std::atomic<std::size_t> wrong = 0;
    trace::ReflectionOptions options;
    options.bounces = bounces;
    samples.eachPacketOf(
        slots, options, [&](std::span<const std::uint32_t> of, trace::PointLanes& lanes) {
          EXPECT_EQ(of.size(), lanes.count);
          for (std::size_t k = 0; k < of.size(); ++k) {
            if (of[k] == 0) continue;
            ++seen;
            const std::size_t i = of[k] - 1;
            // A packet is 16 rays, counted from the tile's first one.
            const std::size_t lane = (i - tileOf[i]) % 16;
            wrong += k % 16 == lane ? 0 : 1;
            for (std::size_t n = k - lane; n < std::min(k - lane + 16, of.size()); ++n)
              wrong += lanes.direction.at(n) == directions[i - lane + n - (k - lane)] ? 0 : 1;
          }
        });
    EXPECT_EQ(seen, (slots.size() + 36) / 37);
    EXPECT_EQ(wrong, 0u);
  }
}

/// A mirror and before it slats and a wall of triangles so small that some rays meet two at one
/// distance: which of them Embree names depends on the rays beside it.
scene::Scene fineWall() {
  test::SceneBuilder builder;
  const Mat4 upright = test::rotation(90.0f, {1.0f, 0.0f, 0.0f});
  builder.add(scene::makePlane({4.0f, 3.0f}, {8, 6}, scene::UvMode::Unit), builder.reflective(1.0f),
              upright);
  scene::Mesh wall = scene::makePlane({4.0f, 3.0f}, {300, 250}, scene::UvMode::Unit);
  for (std::size_t i = 0; i < wall.positions.size(); ++i)
    wall.colors.emplace_back(0.1f + 0.007f * static_cast<float>(i * 37 % 101));
  builder.add(std::move(wall), builder.diffuse({0.7f, 0.6f, 0.5f}),
              test::translation({0.0f, 0.0f, 6.0f}) * upright);
  const int dark = builder.diffuse({0.1f, 0.1f, 0.1f});
  for (int i = 0; i < 40; ++i)
    builder.add(scene::makePlane({0.02f, 3.0f}, {1, 1}, scene::UvMode::Unit), dark,
                test::translation({0.1f * static_cast<float>(i) - 2.0f, 0.0f, 2.0f}) * upright);
  builder.constantEnvironment({0.4f, 0.5f, 0.6f});
  return std::move(builder.scene());
}
scene::Camera beforeWall(float y) {
  return scene::lookAt({y, 0.3f, 3.5f}, {0.0f, 0.0f, 0.0f}, {0.0f, 1.0f, 0.0f}, 0.8f);
}

TEST(Reprojection, HasTracedsBitsAlongEdges) {
  test::GlStage stage(fineWall(), test::framesOf(256, 256, 1, true));
  for (const std::string& mapping : kMappings) {
    for (const int every : {0, 1}) {
      for (const int bounces : {1, 2}) {
        test::GlMethod method(
            stage, reprojectionEntry(),
            with(mapping, R"("keyframe_threshold": 1, "keyframe_every": )" + std::to_string(every) +
                              ", \"bounces\": " + std::to_string(bounces)));
        for (const float y : {0.2f, 0.22f, 0.24f}) {
          const FrameOutput output = method.render(beforeWall(y));
          trace::ReflectionOptions rays;
          rays.bounces = bounces;
          const test::TracedSamples samples(stage, beforeWall(y), rays);
          const bool key = output.counters.at("key_frame") != 0;
          EXPECT_EQ(key, every == 1 || y == 0.2f);
          if (!key) {
            EXPECT_GT(output.counters.at("retraced"), 100u);
          }
          const auto masks = raster::readMasks(stage.gbuffer.masks);
          EXPECT_EQ(samplesThat(samples, masks, !key, samples.traced), 0) << mapping << y;
        }
      }
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
  for (const std::string& mapping : {kMappings[1], kMappings[0]}) {
    test::GlMethod method(stage, reprojectionEntry(), with(mapping, R"("keyframe_threshold": 1)"));
    method.render(from(eye));
    const FrameOutput output = method.render(camera);
    EXPECT_EQ(output.counters.at("key_frame"), 0u);
    const test::TracedSamples samples(stage, camera, {});
    const auto masks = raster::readMasks(stage.gbuffer.masks);
    EXPECT_EQ(samplesThat(samples, masks, true, samples.traced), 0) << mapping;
    EXPECT_EQ(output.counters.at("reused") + output.counters.at("retraced"), samples.places.size());
    EXPECT_GT(output.counters.at("reused"), 2 * output.counters.at("retraced"));
    EXPECT_TRUE(samples.finite());
    if (mapping == "surface") {
      warpedError = samples.l1Of8Bit();
    } else {
      EXPECT_LT(samples.l1Of8Bit(), 0.5 * warpedError);
    }
  }
}

// Normals of a coarse ball send rays at its outline below its surface: they are bent, and marked.
TEST(Reprojection, MarksWhatItFindsAsTracedDoes) {
  test::SceneBuilder builder;
  builder.add(scene::makeSphere(1.0f, 12, 6, scene::UvMode::Unit), builder.reflective(1.0f));
  builder.constantEnvironment({0.4f, 0.5f, 0.6f});
  test::GlStage stage(std::move(builder.scene()), test::framesOf(96, 96, 1, true));
  const auto from = [](float x) {
    return scene::lookAt({x, 0.0f, 4.0f}, {0.0f, 0.0f, 0.0f}, {0.0f, 1.0f, 0.0f}, 0.7f);
  };
  // Rays below the horizon lie at the rim.
  test::GlMethod method(stage, reprojectionEntry(),
                        R"({"keyframe_threshold": 1, "edges": "trace"})");
  test::GlMethod traced(stage, reprojectionEntry(), R"({"keyframe_every": 1})");
  for (const float x : {0.0f, 0.0f, 0.004f}) {
    const std::uint64_t retraced = method.render(from(x)).counters.at("retraced");
    const auto bent = samplesWith(stage, raster::kMaskBelowHorizon);
    const auto sky = samplesWith(stage, raster::kMaskSky);
    EXPECT_GT(bent.size(), retraced);
    EXPECT_GT(sky.size(), bent.size());
    traced.render(from(x));
    EXPECT_EQ(bent, samplesWith(stage, raster::kMaskBelowHorizon)) << x;
    EXPECT_EQ(sky, samplesWith(stage, raster::kMaskSky)) << x;
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
    EXPECT_GE(output.counters.at("rays"),
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
  for (const std::string& mapping : kMappings)
    for (const char* options :
         {R"("keyframe_threshold": 1)", R"("keyframe_threshold": 1, "bounces": 2)"}) {
      test::GlMethod method(stage, reprojectionEntry(), with(mapping, options));
      method.render(spheresFrom(kEye));
      const std::vector<float> before = raster::readRgba(stage.gbuffer.reflection);
      const FrameOutput output = method.render(spheresFrom(kEye));
      EXPECT_EQ(output.counters.at("key_frame"), 0u);
      // But samples without a neighbour that shows the same.
      EXPECT_LE(10 * output.counters.at("second_bounce"), output.counters.at("reused"));
      EXPECT_EQ(raster::readRgba(stage.gbuffer.reflection), before) << mapping << options;
    }
}

// Beside another method, frames that are restarts of this one alone are not told to it.
TEST(Reprojection, RestartsOnItsOwnGrid) {
  test::GlStage stage(sceneOf("nine_spheres"), test::framesOf(32, 32, 1, true));
  test::GlMethod method(stage, reprojectionEntry(),
                        R"({"keyframe_threshold": 1, "restart_every": 3})");
  for (int frame = 1; frame <= 7; ++frame)
    EXPECT_EQ(method.render(spheresFrom(kEye)).counters.at("key_frame"), frame % 3 == 1 ? 1u : 0u);
  // Where nothing reflects, too
  const auto away = scene::lookAt(kEye, 2.0f * kEye, {0.0f, 1.0f, 0.0f}, 0.7f);
  for (int frame = 8; frame <= 10; ++frame) {
    const FrameOutput output = method.render(away);
    EXPECT_EQ(output.counters.at("key_frame"), frame % 3 == 1 ? 1u : 0u);
    EXPECT_EQ(output.counters.at("rays"), 0u);
  }
}

TEST(Reprojection, EqualsItsControlWhenTheCameraOnlyTurns) {
  test::GlStage stage(sceneOf("planar_mirror"), test::framesOf(128, 128, 1, true));
  const auto before = scene::lookAt({0.3f, 1.35f, 1.2f}, {0.0f, 1.0f, -2.0f}, {0, 1, 0}, 0.8f);
  const auto after = scene::lookAt({0.3f, 1.35f, 1.2f}, {0.06f, 1.04f, -2.0f}, {0, 1, 0}, 0.8f);
  std::vector<std::vector<Vec3>> ours;
  std::vector<std::vector<std::uint16_t>> masks;
  std::vector<std::uint32_t> places;
  for (const std::string& mapping : kMappings) {
    test::GlMethod method(stage, reprojectionEntry(), with(mapping, R"("keyframe_threshold": 1)"));
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
