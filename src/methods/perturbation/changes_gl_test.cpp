// Frames after something moved: as of a run of their own, drawn only where something changed.
#include <gtest/gtest.h>

#include "methods/perturbation/test_comparison.h"

namespace catoptric::methods {
namespace {

TEST(PerturbationChanges, MovesAReflectorInReflections) {
  const auto moving = [] {
    test::SceneBuilder builder =
        twoMirrors(sphereMesh(0.45, 12), test::translation({0.6f, 0.0f, 0.3f}));
    builder.move(3, {0.2f, 0.2f, 0.0f}, 2.0f);
    return builder.scene();
  };
  const char* options = R"({"bounces": 2})";
  Comparison one(moving(), kFront, options, {.bounces = 2});
  one.moveTo(1.0);
  EXPECT_LT(one.l1Of8Bit, 0.2);
  Comparison other(moving(), kFront, options, {.bounces = 2});
  other.moveTo(0.3);
  other.moveTo(1.0);
  EXPECT_EQ(one.reflection, other.reflection);
}

TEST(PerturbationChanges, HidesWhatIsScaledToNothing) {
  const auto shrinking = [](const std::vector<Vec2>& keys) {
    test::SceneBuilder builder =
        twoMirrors(sphereMesh(0.45, 12), test::translation({0.6f, 0.0f, 0.3f}));
    builder.scaleUniformly(3, keys);
    return builder.scene();
  };
  const char* options = R"({"bounces": 2})";
  const scene::Scene scene = shrinking({{0.0f, 0.0f}, {1.0f, 1.0f}, {2.0f, 0.0f}});
  Comparison ball(scene, kFront, options, {.bounces = 2});
  EXPECT_LT(ball.l1Of8Bit, 0.15);
  const std::size_t without = ball.samples;
  const std::vector<Vec3> hidden = ball.reflection;
  ball.moveTo(1.0);
  EXPECT_GT(ball.samples, without);
  EXPECT_LT(ball.l1Of8Bit, 0.4);
  Comparison shown(shrinking({{0.0f, 1.0f}, {1.0f, 1.0f}}), kFront, options, {.bounces = 2});
  EXPECT_EQ(ball.reflection, shown.reflection);
  ball.moveTo(2.0);
  EXPECT_EQ(ball.samples, without);
  EXPECT_EQ(ball.reflection, hidden);
}

TEST(PerturbationChanges, FollowsWhatMovesAndGivesTheFrameOfAFreshRun) {
  const auto moving = [] {
    test::SceneBuilder builder = stage(sphereMesh(0.7), test::translation({0.0f, 0.3f, 0.0f}));
    builder.move(2, {0.0f, 0.0f, 0.5f}, 2.0f);
    return builder.scene();
  };
  Comparison one(moving(), kFront);
  const std::vector<Vec3> before = one.reflection;
  const std::uint64_t allVertices = one.output.counters["vertices"];
  one.moveTo(1.0);
  EXPECT_NE(one.reflection, before);
  EXPECT_LT(one.l1Of8Bit, 0.15);
  // Only the box is computed again
  EXPECT_LT(one.output.counters["vertices"], allVertices / 2);
  Comparison other(moving(), kFront);
  other.moveTo(0.3);
  other.moveTo(1.0);
  EXPECT_EQ(one.reflection, other.reflection);
}

TEST(PerturbationChanges, FollowsACameraAndObjectsThatMoveTogether) {
  const auto moving = [] {
    test::SceneBuilder builder = stage(sphereMesh(0.7), test::translation({0.0f, 0.3f, 0.0f}));
    builder.move(0, {-0.2f, 0.0f, 0.0f}, 2.0f);
    builder.move(2, {0.0f, 0.0f, 0.5f}, 2.0f);
    return builder.scene();
  };
  const auto at = [](float seconds) {
    return cameraAt({0.2f + 0.5f * seconds, 0.7f, 3.2f}, {0.2f, 0.0f, 0.0f});
  };
  Comparison together(moving(), at(0.0f));
  for (const float seconds : {0.5f, 1.0f, 1.5f}) {
    together.lookFrom(at(seconds), seconds);
    EXPECT_LT(together.l1Of8Bit, 0.15) << seconds;
    EXPECT_TRUE(together.finite);
    Comparison fresh(moving(), at(seconds));
    fresh.lookFrom(at(seconds), seconds);
    EXPECT_EQ(together.reflection, fresh.reflection) << seconds;
  }
  // The camera stops, the objects do not
  together.moveTo(1.8);
  EXPECT_LT(together.l1Of8Bit, 0.12);
  Comparison fresh(moving(), at(1.5f));
  fresh.lookFrom(at(1.5f), 1.8);
  EXPECT_EQ(together.reflection, fresh.reflection);
}

/// A wall of mirrors, each turned a little, before a floor and a box that moves.
scene::Scene wallOfMirrors() {
  test::SceneBuilder builder = stage(scene::makePlane({0.2f, 0.2f}, {1, 1}, scene::UvMode::Unit),
                                     uprightAt({-1.2f, 0.0f, -0.5f}));
  const int mirror = builder.reflective(0.9f);
  for (int i = 1; i < 144; ++i) {
    const int row = i / 12;
    const Vec3 at(-1.2f + 0.22f * static_cast<float>(i % 12), 0.22f * static_cast<float>(row),
                  -0.5f);
    builder.add(scene::makePlane({0.2f, 0.2f}, {1, 1}, scene::UvMode::Unit), mirror,
                uprightAt(at) * test::rotation(static_cast<float>(i % 7 - 3), {0.0f, 0.0f, 1.0f}));
  }
  builder.move(2, {-0.3f, 0.0f, 0.0f}, 2.0f);
  return builder.scene();
}

TEST(PerturbationChanges, ManyMirrorsStayWithinTheirMemory) {
  Comparison all(wallOfMirrors(), kFront);
  EXPECT_GT(all.samples, 5000u);
  EXPECT_LT(all.l1Of8Bit, 0.05);
  EXPECT_EQ(all.output.counters.at("objects_left_out"), 0u);
  // Of 144 mirrors and 146 objects nearly none see each other
  EXPECT_LT(all.output.counters.at("vertices"), 20u * 144u * 26u / 4u);
  const char* const little = R"({"memory_mib": 1})";
  Comparison few(wallOfMirrors(), kFront, little);
  EXPECT_GT(few.output.counters.at("objects_left_out"), 20u);
  EXPECT_GT(few.output.counters.at("environment"), all.output.counters.at("environment"));
  // What is left out does not depend on the frames before
  few.moveTo(0.5);
  few.moveTo(1.5);
  Comparison fresh(wallOfMirrors(), kFront, little);
  fresh.moveTo(1.5);
  EXPECT_EQ(few.reflection, fresh.reflection);
  EXPECT_EQ(few.output.counters.at("objects_left_out"),
            fresh.output.counters.at("objects_left_out"));
}

void expectOnlyChangesDrawn(const scene::Scene& scene, const std::string& options,
                            bool countDisocclusions = false) {
  Comparison parts(scene, kFront, options, {}, countDisocclusions);
  Comparison whole(scene, kFront, options, {}, countDisocclusions);
  for (const double seconds : {0.5, 1.0, 1.0, 1.6}) {
    parts.moveTo(seconds, true);
    whole.moveTo(seconds);
    EXPECT_EQ(parts.reflection, whole.reflection) << seconds;
    EXPECT_EQ(parts.masks, whole.masks) << seconds;
    EXPECT_EQ(parts.output.counters, whole.output.counters) << seconds;
    EXPECT_FALSE(whole.output.changedReflection);
    ASSERT_TRUE(parts.output.changedReflection);
    EXPECT_FALSE(parts.output.changedReflection->touches({0, 0, 64, 256}));
  }
}

TEST(PerturbationChanges, DrawsOnlyWhereSomethingChanged) {
  test::SceneBuilder builder = stage(sphereMesh(0.7), test::translation({0.0f, 0.3f, 0.0f}));
  builder.move(2, {-0.6f, 0.0f, 0.5f}, 2.0f);
  expectOnlyChangesDrawn(builder.scene(), "{}");
}

TEST(PerturbationChanges, DrawsOnlyWhereSomethingChangedInReflectionsOfReflections) {
  test::SceneBuilder builder =
      twoMirrors(sphereMesh(0.45, 12), test::translation({0.6f, 0.0f, 0.3f}));
  builder.move(2, {-0.3f, 0.0f, 0.5f}, 2.0f);
  expectOnlyChangesDrawn(builder.scene(), R"({"bounces": 2})");
}

TEST(PerturbationChanges, KeepsWhatStandsStillBehindWhatPassesTheReflectors) {
  for (const bool mirrorCouldMove : {false, true}) {
    test::SceneBuilder builder =
        twoMirrors(sphereMesh(0.45, 12), test::translation({0.6f, 0.0f, 0.3f}));
    // The box goes by before both, close to them
    builder.move(2, {-2.4f, 0.0f, 0.1f}, 2.0f);
    if (mirrorCouldMove) builder.move(3, Vec3(0.0f), 2.0f);
    const char* options = R"({"bounces": 3})";
    Comparison parts(builder.scene(), kFront, options);
    Comparison whole(builder.scene(), kFront, options);
    const std::size_t free = whole.samples;
    for (const double seconds : {0.4, 0.9, 1.3, 1.3, 0.7, 2.0}) {
      parts.moveTo(seconds, true);
      whole.moveTo(seconds);
      EXPECT_EQ(parts.reflection, whole.reflection) << seconds;
      EXPECT_EQ(parts.masks, whole.masks) << seconds;
      EXPECT_EQ(parts.output.counters, whole.output.counters) << seconds;
      EXPECT_TRUE(parts.output.changedReflection);
      if (seconds == 0.9) {
        EXPECT_LT(whole.samples, free);
      }
    }
  }
}

TEST(PerturbationChanges, CountsUncoveredSamplesAfterTheCameraHasStopped) {
  test::SceneBuilder builder =
      twoMirrors(sphereMesh(0.45, 12), test::translation({0.6f, 0.0f, 0.3f}));
  builder.move(2, {-0.3f, 0.0f, 0.5f}, 2.0f);
  const char* options = R"({"bounces": 2})";
  // The mirrors fill the frame, and then a part of it
  const scene::Camera near = cameraAt({0.0f, 0.2f, 1.5f}, {0.0f, 0.1f, 0.0f});
  Comparison parts(builder.scene(), near, options);
  parts.lookFrom(kFront);
  parts.moveTo(1.0, true);
  Comparison whole(builder.scene(), kFront, options);
  whole.moveTo(1.0);
  EXPECT_EQ(parts.reflection, whole.reflection);
  EXPECT_EQ(parts.output.counters["environment"], whole.output.counters["environment"]);
}

TEST(PerturbationChanges, CountsGapsInPartsAsInFramesOfTheirOwn) {
  test::SceneBuilder builder = stage(sphereMesh(0.7), test::translation({0.0f, 0.3f, 0.0f}));
  builder.move(2, {-0.6f, 0.0f, 0.5f}, 2.0f);
  expectOnlyChangesDrawn(builder.scene(), "{}", true);
}

TEST(PerturbationChanges, TracesGapsInPartsAsInFramesOfTheirOwn) {
  test::SceneBuilder builder =
      twoMirrors(sphereMesh(0.45, 12), test::translation({0.6f, 0.0f, 0.3f}));
  builder.move(2, {-0.6f, 0.0f, 0.5f}, 2.0f);
  const char* options = R"({"bounces": 2, "gaps": "trace", "sample_spacing": 64})";
  Comparison parts(builder.scene(), kFront, options, {.bounces = 2});
  Comparison whole(builder.scene(), kFront, options, {.bounces = 2});
  for (const double seconds : {0.7, 1.4, 1.4, 0.2}) {
    parts.moveTo(seconds, true);
    whole.moveTo(seconds);
    EXPECT_GT(whole.output.counters["traced_gaps"], 0u) << seconds;
    EXPECT_EQ(parts.reflection, whole.reflection) << seconds;
    EXPECT_EQ(parts.masks, whole.masks) << seconds;
    EXPECT_EQ(parts.output.counters, whole.output.counters) << seconds;
  }
}

}  // namespace
}  // namespace catoptric::methods
