#include "methods/depth_impostors/depth_impostors.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "frame/test_scenes.h"
#include "methods/testing/gl_harness.h"

namespace catoptric::methods {
namespace {

const RunSettings kSettings = test::framesOf(96, 96, 1);
const Vec3 kBall(0.0f, 0.0f, 1.2f);
constexpr float kRadius = 0.5f;

/// A mirror ball and one whose colour says where on it one is.
test::SceneBuilder twoBalls(const Mat4& pose = Mat4(1.0f)) {
  test::SceneBuilder builder;
  builder.constantEnvironment(Vec3(0.0f));
  builder.add(scene::makeSphere(0.4f, 128, 64, scene::UvMode::Unit), builder.reflective(0.9f),
              pose);
  scene::Mesh ball = scene::makeSphere(kRadius, 128, 64, scene::UvMode::Unit);
  for (const Vec3& p : ball.positions) ball.colors.push_back(0.5f + 0.25f * p / kRadius);
  scene::Material material;
  material.unlit = true;
  builder.scene().materials.push_back(material);
  builder.add(std::move(ball), static_cast<int>(builder.scene().materials.size()) - 1,
              pose * test::translation(kBall));
  return builder;
}

scene::Camera camera() {
  return scene::lookAt({1.6f, 0.7f, 1.8f}, Vec3(0.0f), {0.0f, 1.0f, 0.0f}, radians(40.0f));
}

/// Colour where a ray meets the ball.
std::optional<Vec3> colorAt(const Vec3& origin, const Vec3& direction) {
  const Vec3 q = origin - kBall;
  const float b = glm::dot(q, direction);
  const float root = b * b - glm::dot(q, q) + kRadius * kRadius;
  if (root < 0.0f || -b - std::sqrt(root) < 0.0f) return std::nullopt;
  return 0.5f + 0.25f * (q + (-b - std::sqrt(root)) * direction) / kRadius;
}

TEST(DepthImpostors, ABallIsWhereItIs) {
  for (const char* options : {R"({"intersection": "walk"})", R"({"points": 16})",
                              R"({"points": 16, "intersection": "srdm_two_rows"})"}) {
    test::GlStage stage(twoBalls().scene(), kSettings);
    test::GlMethod(stage, depthImpostorsEntry(), options).render(camera());
    const test::TracedSamples samples(stage, camera(), {});
    int hits = 0;
    int missed = 0;
    double error = 0.0;
    for (std::size_t i = 0; i < samples.points.size(); ++i) {
      const trace::ReflectionPoint& point = samples.points[i];
      const std::optional<Vec3> truth =
          colorAt(point.position, glm::normalize(glm::reflect(point.direction, point.normal)));
      const Vec3& ours = samples.ours[i];
      if (!truth) continue;
      ++hits;
      if (ours == Vec3(0.0f)) {
        ++missed;
        continue;
      }
      // In radii of the ball
      error += static_cast<double>(glm::length(ours - *truth) / 0.25f);
    }
    std::printf("%s: %d hits, %d missed, mean error %.4f radii\n", options, hits, missed,
                error / hits);
    EXPECT_GT(hits, 80) << options;
    EXPECT_LE(missed, hits / 20) << options;
    EXPECT_LT(error / hits, 0.02) << options;
  }
}

TEST(DepthImpostors, OnlyAReflectorThatReflectsItselfIsTraced) {
  test::SceneBuilder builder = twoBalls();
  // A corner of three mirrors beside the ball
  const int mirror = builder.reflective(0.9f);
  scene::Mesh corner;
  for (const Mat4& turn : {Mat4(1.0f), test::rotation(90.0f, {1.0f, 0.0f, 0.0f}),
                           test::rotation(-90.0f, {0.0f, 0.0f, 1.0f})}) {
    const auto first = static_cast<std::uint32_t>(corner.positions.size());
    const scene::Mesh side = scene::makePlane({0.5f, 0.5f}, {1, 1}, scene::UvMode::Unit);
    for (std::size_t i = 0; i < side.positions.size(); ++i) {
      corner.positions.emplace_back(turn * Vec4(side.positions[i] - Vec3(0, 0.25f, 0), 1.0f));
      corner.normals.emplace_back(turn * Vec4(side.normals[i], 0.0f));
    }
    for (const std::uint32_t i : side.indices) corner.indices.push_back(first + i);
  }
  constexpr std::uint32_t kCorner = 3;
  builder.add(std::move(corner), mirror, test::translation({0.6f, 0.0f, -0.6f}));
  const RunSettings settings = test::framesOf(96, 96, 1, true);
  for (const bool traces : {true, false}) {
    test::GlStage stage(builder.scene(), settings);
    const FrameOutput output =
        test::GlMethod(stage, depthImpostorsEntry(), traces ? "{}" : R"({"fallback": "none"})")
            .render(camera());
    const test::TracedSamples samples(stage, camera(), {});
    const std::vector<std::uint32_t> ids = raster::readIds(stage.gbuffer.object);
    const std::vector<std::uint16_t> masks = raster::readMasks(stage.gbuffer.masks);
    std::size_t ofCorner = 0;
    std::size_t others = 0;
    for (std::size_t i = 0; i < samples.ours.size(); ++i) {
      const bool corners = ids[samples.places[i]] == kCorner;
      (corners ? ofCorner : others) += 1;
      const bool traced = traces && corners;
      EXPECT_EQ((masks[samples.places[i]] & raster::kMaskRetraced) != 0, traced);
      if (traced) {
        EXPECT_EQ(samples.ours[i], samples.traced[i]);
      }
    }
    EXPECT_GT(ofCorner, 200u);
    EXPECT_GT(others, 300u);
    EXPECT_EQ(output.counters.at("unfit"), 1u);
    EXPECT_EQ(output.counters.at("traced_reflectors"), traces ? 1u : 0u);
    EXPECT_EQ(output.counters.at("traced_samples"), traces ? ofCorner : 0u);
    EXPECT_GT(output.counters.at("impostors_rendered"), 0u);
    const auto table = std::ranges::find(output.tables, "unfit", &Table::name);
    ASSERT_NE(table, output.tables.end());
    EXPECT_EQ(table->rows(), (std::vector<Row>{{std::int64_t{kCorner}, std::string("itself"),
                                                std::int64_t{traces ? 1 : 0}}}));
  }
}

TEST(DepthImpostors, TheProcessorShowsWhatTheDeviceShows) {
  for (const std::string way :
       {R"("walk")", R"("srdm")", R"("srdm_two_rows")", R"("srdm", "refine": 4)",
        R"("srdm", "self_maps": 6, "maps": 1)", R"("srdm", "self_maps": 6, "layers": 2)",
        R"("srdm", "depth_maps": "needed")", R"("walk", "maps": 7)", R"("srdm", "maps": 7)"}) {
    test::GlStage stage(twoBalls().scene(), kSettings);
    std::vector<Vec3> shown[2];
    for (int i = 0; i < 2; ++i) {
      test::GlMethod(stage, depthImpostorsEntry(),
                     R"({"intersection": )" + way + R"(, "intersect_on": ")" +
                         (i == 0 ? "device" : "processor") + R"("})")
          .render(camera());
      shown[i] = test::TracedSamples(stage, camera(), {}).ours;
    }
    ASSERT_EQ(shown[0].size(), shown[1].size());
    std::size_t off = 0;
    for (std::size_t i = 0; i < shown[0].size(); ++i)
      off += glm::length(shown[0][i] - shown[1][i]) > 2.0f / 255.0f ? 1 : 0;
    std::printf("%s: %zu of %zu differ\n", way.c_str(), off, shown[0].size());
    EXPECT_LE(off, shown[0].size() / 100) << way;
  }
}

TEST(DepthImpostors, AChangeOfViewRendersNoImpostor) {
  test::GlStage stage(twoBalls().scene(), kSettings);
  test::GlMethod method(stage, depthImpostorsEntry());
  const FrameOutput first = method.render(camera());
  EXPECT_EQ(first.counters.at("impostors_rendered"), 1u);
  EXPECT_GT(first.counters.at("spans"), 0u);
  const FrameOutput second = method.render(
      scene::lookAt({1.2f, 0.9f, 2.2f}, Vec3(0.0f), {0.0f, 1.0f, 0.0f}, radians(40.0f)));
  EXPECT_EQ(second.counters.at("impostors_rendered"), 0u);
  EXPECT_EQ(second.counters.at("impostors_reused"), 1u);
  EXPECT_EQ(second.counters.at("spans"), 0u);
}

TEST(DepthImpostors, ARigidlyMovedPairShowsTheSame) {
  const Mat4 pose = test::translation({3.0f, 1.0f, -2.0f}) *
                    test::rotation(50.0f, glm::normalize(Vec3(1.0f, 2.0f, 0.5f)));
  std::vector<Vec3> before;
  for (const Mat4& moved : {Mat4(1.0f), pose}) {
    test::GlStage stage(twoBalls(moved).scene(), kSettings);
    scene::Camera seen = camera();
    seen.worldFromCamera = moved * seen.worldFromCamera;
    test::GlMethod(stage, depthImpostorsEntry(), R"({"objects": ["object1"]})").render(seen);
    std::vector<Vec3> shown = test::TracedSamples(stage, seen, {}).ours;
    if (before.empty()) {
      before = std::move(shown);
      continue;
    }
    // Rounding moves a few outlines by a sample
    ASSERT_NEAR(static_cast<double>(before.size()), static_cast<double>(shown.size()), 4.0);
    if (before.size() != shown.size()) return;
    std::size_t off = 0;
    for (std::size_t i = 0; i < shown.size(); ++i)
      off += glm::length(shown[i] - before[i]) > 4.0f / 255.0f ? 1 : 0;
    EXPECT_LE(off, shown.size() / 50);
  }
}

/// A lit ball that moves away from a mirror ball and turns about the line between both.
test::SceneBuilder turningBall() {
  test::SceneBuilder builder = twoBalls();
  builder.constantEnvironment(Vec3(0.5f));
  builder.scene().materials.back().unlit = false;
  builder.scene().bake = {scene::BakeMode::AmbientOcclusion, 64};
  scene::Light& lamp = builder.scene().lights.emplace_back();
  lamp.intensity = Vec3(6.0f);
  lamp.position = {1.0f, 2.0f, 0.0f};
  builder.move(1, {0.0f, 0.0f, 0.2f}, 1.0f);
  scene::AnimationChannel& turn = builder.scene().animation.emplace_back();
  turn.node = builder.scene().objects[1].node;
  turn.target = scene::Target::Rotation;
  turn.times = {0.0f, 1.0f};
  const Quat start = glm::angleAxis(radians(40.0f), glm::normalize(Vec3(1.0f, 1.0f, 0.3f)));
  for (const Quat& q : {start, glm::angleAxis(radians(50.0f), Vec3(0, 0, 1)) * start})
    turn.values.insert(turn.values.end(), {q.x, q.y, q.z, q.w});
  return builder;
}

TEST(DepthImpostors, ARigidlyMovedObjectKeepsItsRows) {
  std::vector<Vec3> first;
  for (const char* options :
       {R"({"fallback": "none"})", R"({"fallback": "none", "intersection": "walk"})",
        R"({"fallback": "none", "intersect_on": "device"})",
        R"({"fallback": "none", "bounces": 2, "layers": 2, "self_maps": 6})"}) {
    std::vector<Vec3> shown[2];
    for (int i = 0; i < 2; ++i) {
      test::GlStage stage(turningBall().scene(), kSettings, true);
      test::GlMethod method(stage, depthImpostorsEntry(), options);
      if (i == 0) method.render(camera());
      const FrameOutput output = method.render(camera(), stage.moveTo(0.5));
      EXPECT_GT(output.counters.at("impostors_rendered"), 0u);
      if (output.counters.contains("rows_reused")) {
        const std::uint64_t rows =
            output.counters.at("rows_reused") + output.counters.at("rows_built");
        EXPECT_EQ(output.counters.at("rows_reused"), i == 0 ? rows : 0u) << options;
        EXPECT_GT(rows, 0u);
        EXPECT_EQ(output.counters.at("spans") > 0, i == 1);
      }
      shown[i] = test::TracedSamples(stage, camera(), {}).ours;
    }
    EXPECT_EQ(shown[0], shown[1]) << options;
    // The CPU lights what the device draws
    if (first.empty()) first = shown[0];
    std::size_t off = 0;
    for (std::size_t k = 0; k < first.size(); ++k)
      off += glm::length(first[k] - shown[0][k]) > 2.0f / 255.0f ? 1 : 0;
    EXPECT_LE(off, first.size() / 100) << options;
  }
}

// A half turn about y changes signs alone, so nothing is rounded otherwise.
TEST(DepthImpostors, APairTurnedHalfAroundHasTheSameBits) {
  Mat4 half(1.0f);
  half[0][0] = half[2][2] = -1.0f;
  std::vector<Vec3> shown[2];
  for (const std::string more : {"", R"(, "intersection": "walk")"}) {
    for (int i = 0; i < 2; ++i) {
      const Mat4 pose = i == 0 ? Mat4(1.0f) : half;
      test::GlStage stage(twoBalls(pose).scene(), kSettings);
      scene::Camera seen = camera();
      seen.worldFromCamera = pose * seen.worldFromCamera;
      test::GlMethod(stage, depthImpostorsEntry(), R"({"objects": ["object1"])" + more + "}")
          .render(seen);
      shown[i] = test::TracedSamples(stage, seen, {}).ours;
    }
    EXPECT_GT(shown[0].size(), 300u);
    EXPECT_EQ(shown[0], shown[1]) << more;
  }
}

/// A ball on a mirror floor whose middle is elsewhere.
double missingOfABallOnAFloor(const char* options, const FrameOutput** output = nullptr) {
  static FrameOutput frame;
  test::SceneBuilder builder;
  builder.constantEnvironment(Vec3(0.0f));
  builder.add(scene::makePlane({6.0f, 6.0f}, {1, 1}, scene::UvMode::Unit), builder.reflective(0.9f),
              test::translation({1.0f, 0.0f, 0.5f}));
  scene::Material material;
  material.unlit = true;
  builder.scene().materials.push_back(material);
  builder.add(scene::makeSphere(0.4f, 128, 64, scene::UvMode::Unit),
              static_cast<int>(builder.scene().materials.size()) - 1,
              test::translation({0.0f, 0.4f, 0.0f}));
  test::GlStage stage(builder.scene(), kSettings);
  const scene::Camera seen =
      scene::lookAt({0.4f, 1.0f, 2.6f}, Vec3(0.0f, 0.1f, 0.3f), {0, 1, 0}, radians(40.0f));
  frame = test::GlMethod(stage, depthImpostorsEntry(), options).render(seen);
  if (output != nullptr) *output = &frame;
  const test::TracedSamples samples(stage, seen, {});
  int hits = 0;
  int wrong = 0;
  for (std::size_t i = 0; i < samples.ours.size(); ++i) {
    hits += samples.traced[i].x > 0.5f ? 1 : 0;
    wrong += (samples.ours[i].x > 0.5f) != (samples.traced[i].x > 0.5f) ? 1 : 0;
  }
  EXPECT_GT(hits, 300);
  return static_cast<double>(wrong) / hits;
}

TEST(DepthImpostors, NothingOfABallOnAFloorIsMissing) {
  const double one = missingOfABallOnAFloor(R"({"maps": 1})");
  for (const char* options : {"{}", R"({"intersect_on": "device"})", R"({"intersection": "walk"})",
                              R"({"intersection": "walk", "intersect_on": "device"})"}) {
    const FrameOutput* output = nullptr;
    const double wrong = missingOfABallOnAFloor(options, &output);
    std::printf("%s: %.3f of the ball's samples are wrong, %.3f with one map; %llu unseen\n",
                options, wrong, one,
                static_cast<unsigned long long>(output->counters.at("disoccluded")));
    EXPECT_LT(wrong, 0.03) << options;
    EXPECT_LE(output->counters.at("impostors_rendered"), 8u);
  }
  EXPECT_GT(one, 0.2);
}

/// A ball above a plate, in one mesh.
scene::Mesh ballOnPlate() {
  scene::Mesh ball = scene::makeSphere(0.3f, 96, 48, scene::UvMode::Unit);
  for (Vec3& p : ball.positions) p.y += 0.4f;
  const scene::Mesh plate = scene::makePlane({2.0f, 2.0f}, {8, 8}, scene::UvMode::Unit);
  const auto first = static_cast<std::uint32_t>(ball.positions.size());
  ball.positions.insert(ball.positions.end(), plate.positions.begin(), plate.positions.end());
  ball.normals.insert(ball.normals.end(), plate.normals.begin(), plate.normals.end());
  ball.uv[0].insert(ball.uv[0].end(), plate.uv[0].begin(), plate.uv[0].end());
  for (const std::uint32_t index : plate.indices) ball.indices.push_back(first + index);
  return ball;
}

/// Mean errors of a mirror in a white environment, without maps of its own, with one and with six.
std::array<double, 3> errorsOfItself(scene::Mesh mesh) {
  test::SceneBuilder builder;
  builder.constantEnvironment(Vec3(1.0f));
  builder.add(std::move(mesh), builder.reflective(0.9f));
  test::GlStage stage(builder.scene(), kSettings);
  std::array<double, 3> errors{};
  constexpr int kMaps[] = {0, 1, 6};
  for (std::size_t i = 0; i < errors.size(); ++i) {
    test::GlMethod(
        stage, depthImpostorsEntry(),
        R"({"points": 16, "fallback": "none", "self_maps": )" + std::to_string(kMaps[i]) + "}")
        .render(camera());
    const test::TracedSamples samples(stage, camera(), {});
    for (std::size_t k = 0; k < samples.ours.size(); ++k)
      errors[i] += static_cast<double>(glm::length(samples.ours[k] - samples.traced[k]));
    errors[i] /= static_cast<double>(samples.ours.size());
  }
  std::printf("mean error without maps %.4f, with one %.4f, with six %.4f\n", errors[0], errors[1],
              errors[2]);
  return errors;
}

TEST(DepthImpostors, AReflectorShowsItself) {
  const std::array<double, 3> errors = errorsOfItself(ballOnPlate());
  EXPECT_GT(errors[0], 0.02);
  EXPECT_LT(errors[2], 0.5 * errors[0]);
}

TEST(DepthImpostors, TheFunnelOfAnOpenVaseStaysAsBrightAsItIs) {
  scene::RevolutionShape vase;
  vase.profile = {{0.15f, -0.5f}, {0.3f, -0.3f}, {0.1f, 0.0f}, {0.3f, 0.3f}};
  vase.caps = false;
  const std::array<double, 3> errors =
      errorsOfItself(scene::makeRevolution(vase, scene::UvMode::Unit));
  EXPECT_GT(errors[0], 0.01);
  EXPECT_LT(errors[1], 1.01 * errors[0]);
  EXPECT_LT(errors[2], 0.7 * errors[0]);
}

// The nearer side of a ring hides the farther one, from its axes, too.
TEST(DepthImpostors, PeeledMapsShowWhatOneMapHides) {
  test::SceneBuilder builder;
  builder.constantEnvironment(Vec3(1.0f));
  builder.add(scene::makeTorus(0.35f, 0.15f, 96, 48, scene::UvMode::Unit),
              builder.reflective(0.9f));
  test::GlStage stage(builder.scene(), kSettings);
  double errors[2] = {};
  for (int i = 0; i < 2; ++i) {
    const FrameOutput output =
        test::GlMethod(stage, depthImpostorsEntry(),
                       i == 0
                           ? R"({"points": 16, "self_maps": 6, "fallback": "none"})"
                           : R"({"points": 16, "self_maps": 6, "layers": 2, "fallback": "none"})")
            .render(camera());
    EXPECT_EQ(output.counters.at("impostors_rendered"), i == 0 ? 6u : 12u);
    const test::TracedSamples samples(stage, camera(), {});
    for (std::size_t k = 0; k < samples.ours.size(); ++k)
      errors[i] += static_cast<double>(glm::length(samples.ours[k] - samples.traced[k]));
    errors[i] /= static_cast<double>(samples.ours.size());
  }
  std::printf("mean error of one map %.4f, of two %.4f\n", errors[0], errors[1]);
  EXPECT_LT(errors[1], 0.7 * errors[0]);
}

}  // namespace
}  // namespace catoptric::methods
