// Sequences at the extremes: each has a defined answer, every sample of it is counted, none is NaN,
// what was traced anew has traced's bits, and the error stays within a bound.
#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <vector>

#include "frame/test_scenes.h"
#include "methods/reprojection/reprojection.h"
#include "methods/testing/gl_harness.h"

namespace catoptric::methods {
namespace {

using test::SceneBuilder;

struct Sequence {
  int width = 96;
  int height = 96;
  int frames = 6;
  float seconds = 0.0f;  ///< of the scene's time, from frame to frame
  int bounces = 1;
  std::string options = R"("keyframe_threshold": 1)";
  std::function<scene::Camera(int)> camera;
};

struct Worst {
  double l1 = 0.0;
  std::uint64_t reused = 0;
  std::uint64_t keys = 0;
  std::uint64_t samples = 0;
};

/// Renders a sequence and holds every frame to what all must satisfy.
Worst render(const scene::Scene& scene, const Sequence& sequence) {
  test::GlStage stage(scene, test::framesOf(sequence.width, sequence.height, 1, true));
  test::GlMethod method(stage, reprojectionEntry(),
                        "{" + sequence.options + ", \"bvh\": \"refit\", \"bounces\": " +
                            std::to_string(sequence.bounces) + "}");
  Worst worst;
  for (int frame = 0; frame < sequence.frames; ++frame) {
    std::vector<int> changed;
    if (sequence.seconds > 0.0f)
      changed = stage.moveTo(static_cast<double>(sequence.seconds) * frame);
    const scene::Camera camera = sequence.camera(frame);
    const FrameOutput output = method.render(camera, changed);
    trace::ReflectionOptions rays;
    rays.bounces = sequence.bounces;
    const test::TracedSamples samples(stage, camera, rays);
    EXPECT_TRUE(samples.finite()) << "frame " << frame;
    EXPECT_EQ(output.counters.at("reused") + output.counters.at("retraced") +
                  output.counters.at("key_frame_samples"),
              samples.places.size());
    EXPECT_EQ(output.counters.at("not_finite"), 0u);
    const auto masks = raster::readMasks(stage.gbuffer.masks);
    int different = 0;
    for (std::size_t i = 0; i < samples.places.size(); ++i)
      if ((masks[samples.places[i]] & raster::kMaskRetraced) != 0 &&
          samples.ours[i] != samples.traced[i])
        ++different;
    EXPECT_EQ(different, 0) << "frame " << frame;
    worst.l1 = std::max(worst.l1, samples.l1Of8Bit());
    worst.reused += output.counters.at("reused");
    worst.keys += output.counters.at("key_frame");
    worst.samples += samples.places.size();
  }
  return worst;
}

/// Balls before a mirror on the wall z = 0 and a mirror opposite, everything times `scale`.
SceneBuilder mirrors(float scale, bool opposite) {
  SceneBuilder builder;
  const Mat4 size = glm::scale(Mat4(1.0f), Vec3(scale));
  const Mat4 upright = test::rotation(90.0f, {1.0f, 0.0f, 0.0f});
  builder.add(scene::makePlane({4.0f, 3.0f}, {8, 6}, scene::UvMode::Unit), builder.reflective(1.0f),
              size * upright);
  const int floor = builder.diffuse({0.5f, 0.45f, 0.3f});
  builder.add(scene::makePlane({8.0f, 12.0f}, {8, 8}, scene::UvMode::Unit), floor,
              size * test::translation({0.0f, -1.5f, 3.0f}));
  const int red = builder.diffuse({0.7f, 0.1f, 0.1f}, {0.2f, 0.02f, 0.02f});
  const int blue = builder.diffuse({0.1f, 0.2f, 0.7f}, {0.02f, 0.05f, 0.2f});
  for (int i = 0; i < 4; ++i)
    builder.add(scene::makeSphere(0.25f, 32, 16, scene::UvMode::Unit), i % 2 == 0 ? red : blue,
                size * test::translation({-1.2f + 0.8f * static_cast<float>(i), -0.3f,
                                          0.6f + 0.5f * static_cast<float>(i)}));
  if (opposite)
    builder.add(
        scene::makePlane({4.0f, 3.0f}, {8, 6}, scene::UvMode::Unit), builder.reflective(0.9f),
        size * test::translation({0.0f, 0.0f, 6.0f}) * test::rotation(-90.0f, {1.0f, 0.0f, 0.0f}));
  builder.constantEnvironment({0.4f, 0.5f, 0.6f});
  return builder;
}

scene::Camera before(float scale, const Vec3& eye, const Vec3& target = {0.0f, 0.0f, 0.0f}) {
  scene::Camera camera = scene::lookAt(scale * eye, scale * target, {0.0f, 1.0f, 0.0f}, 0.8f);
  camera.nearMetres = 0.01f * scale;
  return camera;
}
std::function<scene::Camera(int)> sideways(float scale, float step) {
  return [=](int frame) {
    return before(scale, {0.2f + step * static_cast<float>(frame), 0.3f, 3.5f});
  };
}

/// Records how far off its frames were, for docs/extremes.csv (tests/extremes), which holds
/// its bound to three times that or 0.05 above it.
class ReprojectionSequences : public testing::Test {
 protected:
  void isBelow(double l1, double bound) {
    EXPECT_LT(l1, bound);
    worst_ = std::max(worst_, l1);
    RecordProperty("l1", std::to_string(worst_));
    RecordProperty("bound", std::to_string(bound));
  }

 private:
  double worst_ = 0.0;
};

TEST_F(ReprojectionSequences, HoldAtEveryScale) {
  for (const float scale : {1e-4f, 1.0f, 1e5f}) {
    const Worst worst = render(mirrors(scale, false).scene(), {.camera = sideways(scale, 0.02f)});
    isBelow(worst.l1, 0.05);
    EXPECT_GT(worst.reused, worst.samples / 2) << scale;
  }
}

TEST_F(ReprojectionSequences, HoldInTheSmallestFrame) {
  const Worst worst = render(mirrors(1.0f, false).scene(),
                             {.width = 1, .height = 1, .camera = sideways(1.0f, 0.02f)});
  EXPECT_EQ(worst.samples, 6u);
  isBelow(worst.l1, 0.05);
}

TEST_F(ReprojectionSequences, HoldWhereAMirrorFillsTheFrame) {
  const auto camera = [](int frame) {
    return before(1.0f, {0.05f * static_cast<float>(frame), 0.1f, 0.45f});
  };
  const Worst worst = render(mirrors(1.0f, false).scene(), {.camera = camera});
  EXPECT_EQ(worst.samples, 6u * 96u * 96u);
  isBelow(worst.l1, 0.05);
}

// A frame about a mirror: its narrow reflection at the rim comes out as the camera goes on.
TEST(ReprojectionRims, ComeOutOfAMirrorInAFrame) {
  SceneBuilder builder = mirrors(1.0f, false);
  const int dark = builder.diffuse({0.02f, 0.02f, 0.02f});
  for (const float side : {-1.0f, 1.0f})
    builder.add(scene::makePlane({0.1f, 3.0f}, {1, 1}, scene::UvMode::Unit), dark,
                test::translation({2.0f * side, 0.0f, 0.05f}) *
                    test::rotation(90.0f, {0.0f, 1.0f, 0.0f}) *
                    test::rotation(90.0f, {1.0f, 0.0f, 0.0f}));
  Sequence sequence{.frames = 12, .camera = sideways(1.0f, 0.08f)};
  const Worst rims = render(builder.scene(), sequence);
  sequence.options = R"("keyframe_threshold": 1, "edges": "trace")";
  const Worst trace = render(builder.scene(), sequence);
  EXPECT_LT(rims.l1, trace.l1);
  EXPECT_LT(rims.reused, trace.reused);
  EXPECT_GT(rims.reused, trace.reused * 8 / 10);
}

TEST_F(ReprojectionSequences, HoldWithTheEyeInTheMirrorsPlane) {
  // Comes through the plane z = 0 beside the mirror.
  const auto camera = [](int frame) {
    return before(1.0f, {2.6f, 0.2f, 0.02f * static_cast<float>(2 - frame)}, {-1.0f, 0.0f, 0.0f});
  };
  isBelow(render(mirrors(1.0f, false).scene(), {.camera = camera}).l1, 0.05);
}

TEST_F(ReprojectionSequences, HoldBetweenParallelMirrors) {
  Sequence sequence{.camera = sideways(1.0f, 0.02f)};
  for (sequence.bounces = 1; sequence.bounces <= 3; ++sequence.bounces) {
    const Worst worst = render(mirrors(1.0f, true).scene(), sequence);
    isBelow(worst.l1, 0.07);
    // Of the second bounce most is found again, of the third nothing.
    if (sequence.bounces == 2) {
      EXPECT_GT(worst.reused, worst.samples * 2 / 3);
    }
  }
}

TEST_F(ReprojectionSequences, HoldWhereOnlyTheSkyIsReflected) {
  SceneBuilder builder;
  builder.add(scene::makePlane({4.0f, 4.0f}, {4, 4}, scene::UvMode::Unit),
              builder.reflective(1.0f));
  builder.constantEnvironment({0.4f, 0.5f, 0.6f});
  const auto camera = [](int frame) {
    return before(1.0f, {0.1f * static_cast<float>(frame), 1.0f, 3.0f});
  };
  const Worst worst = render(builder.scene(), {.camera = camera});
  isBelow(worst.l1, 0.01);
  EXPECT_GT(worst.reused, worst.samples / 2);
}

TEST_F(ReprojectionSequences, HoldWhereSomethingComesBeforeTheSky) {
  // A ball far away comes into view: what was sky in the key frame is traced where it is now.
  SceneBuilder builder;
  builder.add(scene::makePlane({4.0f, 4.0f}, {4, 4}, scene::UvMode::Unit),
              builder.reflective(1.0f));
  const int ball = builder.add(scene::makeSphere(1.5f, 32, 16, scene::UvMode::Unit),
                               builder.diffuse({0.1f, 0.6f, 0.1f}, {0.2f, 0.0f, 0.0f}),
                               test::translation({-12.0f, 6.0f, -12.0f}));
  builder.move(ball, {5.0f, 0.0f, 0.0f}, 4.0f);
  builder.constantEnvironment({0.4f, 0.5f, 0.6f});
  const auto camera = [](int) { return before(1.0f, {0.0f, 1.0f, 3.0f}); };
  const Worst worst = render(builder.scene(), {.seconds = 0.5f, .camera = camera});
  isBelow(worst.l1, 0.05);
  EXPECT_GT(worst.reused, worst.samples / 2);
}

TEST_F(ReprojectionSequences, HoldWhereTheCameraCuts) {
  const auto camera = [](int frame) {
    return frame < 3 ? before(1.0f, {0.2f, 0.3f, 3.5f}) : before(1.0f, {-1.2f, -0.9f, 1.0f});
  };
  isBelow(render(mirrors(1.0f, false).scene(), {.camera = camera}).l1, 0.05);
  // As the paper has it, such a frame becomes a key frame.
  const Worst worst = render(mirrors(1.0f, false).scene(),
                             {.options = R"("keyframe_threshold": 0.3)", .camera = camera});
  EXPECT_GE(worst.keys, 2u);
}

TEST_F(ReprojectionSequences, HoldWhereObjectsMoveAppearAndVanish) {
  SceneBuilder builder = mirrors(1.0f, false);
  const int ball = builder.add(scene::makeSphere(0.3f, 32, 16, scene::UvMode::Unit),
                               builder.diffuse({0.6f, 0.6f, 0.1f}, {0.2f, 0.2f, 0.02f}),
                               test::translation({0.3f, 0.4f, 1.0f}));
  builder.scaleUniformly(ball, {{0.0f, 0.0f}, {1.0f, 1.0f}, {2.0f, 1.0f}, {3.0f, 0.0f}});
  const int other = builder.add(scene::makeSphere(0.3f, 32, 16, scene::UvMode::Unit),
                                builder.diffuse({0.1f, 0.6f, 0.1f}, {0.02f, 0.2f, 0.02f}),
                                test::translation({-1.0f, 0.4f, 1.0f}));
  builder.move(other, {0.5f, 0.0f, 0.0f}, 4.0f);
  const Worst worst =
      render(builder.scene(), {.frames = 10, .seconds = 0.35f, .camera = sideways(1.0f, 0.01f)});
  isBelow(worst.l1, 0.05);
  EXPECT_GT(worst.reused, worst.samples / 3);
}

TEST_F(ReprojectionSequences, HoldWhereLightsChange) {
  SceneBuilder builder = mirrors(1.0f, false);
  const int lamp = builder.add(scene::makeSphere(0.05f, 8, 4, scene::UvMode::Unit),
                               builder.diffuse({0.1f, 0.1f, 0.1f}, {1.0f, 1.0f, 0.8f}),
                               test::translation({-1.0f, 2.0f, 2.0f}));
  builder.move(lamp, {0.8f, 0.0f, 0.0f}, 0.45f);
  scene::Light light;
  light.intensity = Vec3(6.0f);
  light.node = builder.scene().objects[static_cast<std::size_t>(lamp)].node;
  builder.scene().lights.push_back(light);
  // The lamp stops after five of ten frames. Until then all are key frames: traced's bits.
  const Worst moving =
      render(builder.scene(), {.frames = 5, .seconds = 0.1f, .camera = sideways(1.0f, 0.01f)});
  EXPECT_EQ(moving.keys, 5u);
  EXPECT_EQ(moving.l1, 0.0);
  const Worst whole =
      render(builder.scene(), {.frames = 10, .seconds = 0.1f, .camera = sideways(1.0f, 0.01f)});
  EXPECT_EQ(whole.keys, 6u);
  EXPECT_GT(whole.reused, whole.samples / 5);
  isBelow(whole.l1, 0.05);
}

TEST_F(ReprojectionSequences, HoldWhereMirrorsMove) {
  SceneBuilder builder = mirrors(1.0f, false);
  const int ball = builder.add(scene::makeSphere(0.5f, 64, 32, scene::UvMode::Unit),
                               builder.reflective(0.9f), test::translation({-0.4f, 0.2f, 1.4f}));
  builder.move(ball, {0.2f, 0.0f, 0.1f}, 4.0f);
  isBelow(render(builder.scene(), {.seconds = 0.1f, .camera = sideways(1.0f, 0.01f)}).l1, 0.05);
}

TEST_F(ReprojectionSequences, HoldWhereEveryFrameIsAKeyFrame) {
  const Worst worst = render(mirrors(1.0f, false).scene(), {.options = R"("keyframe_every": 1)",
                                                            .camera = sideways(1.0f, 0.02f)});
  EXPECT_EQ(worst.keys, 6u);
  isBelow(worst.l1, 1e-9);
}

TEST_F(ReprojectionSequences, HoldInChainsOfAThousandFrames) {
  // Back and forth without a key frame after the first; the last frame is where the first was.
  const auto camera = [](int frame) {
    const int step = frame % 20 < 10 ? frame % 20 : 20 - frame % 20;
    return before(1.0f, {0.2f + 0.01f * static_cast<float>(step), 0.3f, 3.5f});
  };
  const Worst worst = render(mirrors(1.0f, false).scene(),
                             {.width = 24,
                              .height = 24,
                              .frames = 1000,
                              .options = R"("keyframe_threshold": 1, "restart_every": 100000)",
                              .camera = camera});
  EXPECT_EQ(worst.keys, 1u);
  EXPECT_GT(worst.reused, worst.samples / 4);
  isBelow(worst.l1, 0.05);
}

}  // namespace
}  // namespace catoptric::methods
