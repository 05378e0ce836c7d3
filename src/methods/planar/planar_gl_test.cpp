#include "methods/planar/planar.h"

#include <fmt/core.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "frame/test_scenes.h"
#include "methods/shared/cube_map.h"
#include "methods/testing/gl_harness.h"

namespace catoptric::methods {
namespace {

using test::rotation;
using test::translation;

constexpr int kWidth = 160;
constexpr int kHeight = 120;

scene::Camera camera() {
  return scene::lookAt({1.4f, 1.1f, 2.6f}, {-0.2f, 0.4f, 0.0f}, {0.0f, 1.0f, 0.0f}, 0.9f);
}

/// A corner of three mirrors with a box, a ball, and a wall behind one mirror that must not show.
scene::Scene corner(bool ggx = false) {
  test::SceneBuilder builder;
  builder.scene().environment.type = scene::EnvironmentType::Gradient;
  builder.scene().environment.color = Vec3(0.2f, 0.4f, 0.9f);
  builder.scene().environment.horizon = Vec3(0.8f);
  builder.scene().environment.ground = Vec3(0.3f, 0.2f, 0.1f);
  const auto plane = [] { return scene::makePlane({3.0f, 3.0f}, {1, 1}, scene::UvMode::Unit); };
  int mirror = builder.reflective(0.8f, 0.0f, Vec3(0.5f), Vec3(0.9f, 0.7f, 0.5f));
  if (ggx) {
    builder.scene().materials.back().lobe = scene::LobeModel::Ggx;
    builder.scene().materials.back().dielectricF90 = 0.3f;
  }

  builder.add(plane(), mirror);
  builder.add(plane(), mirror, translation({0.0f, 1.0f, -1.2f}) * rotation(90.0f, {1, 0, 0}));
  mirror = builder.reflective(0.5f);
  builder.add(plane(), mirror, translation({-1.3f, 1.0f, 0.0f}) * rotation(-90.0f, {0, 0, 1}));
  builder.add(scene::makeBox({}, scene::UvMode::Unit), builder.diffuse(Vec3(0.8f, 0.2f, 0.1f)),
              translation({-0.3f, 0.3f, -0.2f}) * glm::scale(Mat4(1.0f), Vec3(0.5f)));
  builder.add(scene::makeSphere(0.25f, 64, 32, scene::UvMode::Unit),
              builder.diffuse(Vec3(0.1f, 0.7f, 0.3f)), translation({0.4f, 0.5f, 0.3f}));
  builder.add(plane(), builder.diffuse(Vec3(5.0f)),
              translation({0.0f, 1.0f, -1.5f}) * rotation(90.0f, {1, 0, 0}));
  return builder.scene();
}

/// Samples of flat mirrors whose radiance differs by more than 0.01.
struct Comparison {
  int compared = 0;
  int different = 0;
};

Comparison compareWithTraced(scene::Scene scene, int bounces, bool fresnel = false) {
  RunSettings settings = test::framesOf(kWidth, kHeight, 1);
  settings.fresnelSchlick = fresnel;
  test::GlStage stage(std::move(scene), settings);
  const std::string options = "{\"bounces\": " + std::to_string(bounces) + "}";
  test::GlMethod(stage, test::methodNamed("traced"), options).render(camera());
  const std::vector<float> traced = raster::readRgba(stage.gbuffer.reflection);
  test::GlMethod(stage, planarEntry(), options).render(camera());
  const std::vector<float> drawn = raster::readRgba(stage.gbuffer.reflection);
  const std::vector<std::uint32_t> ids = raster::readIds(stage.gbuffer.object);
  Comparison result;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    if (ids[i] < 1 || ids[i] > 3) continue;
    ++result.compared;
    float worst = 0.0f;
    for (std::size_t c = 0; c < 3; ++c)
      worst = std::max(worst, std::abs(drawn[4 * i + c] - traced[4 * i + c]));
    result.different += worst > 0.01f ? 1 : 0;
  }
  return result;
}

TEST(Planar, ShowsWhatRaysOfUpToThreeReflectionsMeet) {
  for (int bounces = 1; bounces <= 3; ++bounces) {
    const Comparison all = compareWithTraced(corner(), bounces);
    EXPECT_GT(all.compared, 6000);
    // Edges, where a sample's ray and its pixel differ by rounding
    EXPECT_LT(all.different, all.compared / 200) << bounces << " bounces";
  }
}

TEST(Planar, WeighsMirrorsInMirrorsByFresnelsTerms) {
  for (const bool ggx : {false, true}) {
    const Comparison all = compareWithTraced(corner(ggx), 2, true);
    EXPECT_LT(all.different, all.compared / 200) << ggx;
  }
}

TEST(Planar, ShadesOnlyItsOwnMirrorsButShowsAllInThem) {
  RunSettings settings = test::framesOf(kWidth, kHeight, 1);
  test::GlStage whole(corner(), settings);
  test::GlMethod(whole, planarEntry(), R"({"bounces": 2})").render(camera());
  const std::vector<float> all = raster::readRgba(whole.gbuffer.reflection);
  settings.reflectors = frame::ObjectSet({true, false, false, false, false, false});
  test::GlStage part(corner(), settings);
  part.gbuffer.reflectionFramebuffer.clearColor(0, -1.0f, -1.0f, -1.0f, 1.0f);
  test::GlMethod(part, planarEntry(), R"({"bounces": 2})").render(camera());
  const std::vector<float> own = raster::readRgba(part.gbuffer.reflection);
  const std::vector<std::uint32_t> ids = raster::readIds(part.gbuffer.object);
  int samples = 0;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    samples += ids[i] == 1 ? 1 : 0;
    ASSERT_EQ(own[4 * i], ids[i] == 1 ? all[4 * i] : -1.0f) << i;
  }
  EXPECT_GT(samples, 1000);
}

/// The corner's reflections, by its first three objects.
struct CornerFrame {
  FrameOutput output;
  std::vector<float> shown;
  std::vector<std::uint32_t> ids;
  std::vector<std::uint16_t> masks;

  CornerFrame(const MethodEntry& method, const std::string& options) {
    test::GlStage stage(corner(), test::framesOf(kWidth, kHeight, 1, true));
    output = test::GlMethod(stage, method, options).render(camera());
    shown = raster::readRgba(stage.gbuffer.reflection);
    ids = raster::readIds(stage.gbuffer.object);
    masks = raster::readMasks(stage.gbuffer.masks);
  }
  /// Samples of an object that differ from another frame's by more than `most`.
  int different(std::uint32_t id, const CornerFrame& other, float most = 0.0f) const {
    int count = 0;
    for (std::size_t i = 0; i < ids.size(); ++i) {
      float worst = 0.0f;
      for (std::size_t c = 0; c < 3; ++c)
        worst = std::max(worst, std::abs(shown[4 * i + c] - other.shown[4 * i + c]));
      count += ids[i] == id && worst > most ? 1 : 0;
    }
    return count;
  }
};

TEST(Planar, DrawsTheLargestMirrorsWithinItsBudget) {
  const CornerFrame all(planarEntry(), "{}");
  std::array<std::uint64_t, 4> samples{};
  for (const std::uint32_t id : all.ids) samples[std::min(id, 4u) % 4] += id > 0 ? 1 : 0;
  std::array<std::uint32_t, 3> largest = {1, 2, 3};
  std::ranges::sort(largest, std::ranges::greater(), [&](std::uint32_t id) { return samples[id]; });
  for (const char* fallback : {"environment_map", "traced"}) {
    const CornerFrame other(test::methodNamed(fallback),
                            fallback[0] == 'e' ? R"({"face_size": 256})" : "{}");
    const bool looksUp = fallback[0] == 'e';
    for (std::size_t budget = 1; budget <= 3; ++budget) {
      const CornerFrame some(
          planarEntry(),
          fmt::format(R"({{"max_mirrors": {}, "fallback": "{}"}})", budget, fallback));
      const std::uint16_t mark = looksUp ? raster::kMaskEnvironment : raster::kMaskRetraced;
      std::uint64_t leftOut = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        const bool drawn = k < budget;
        const std::uint32_t id = largest[k];
        EXPECT_EQ(some.different(id, drawn ? all : other), 0) << fallback << " " << budget;
        if (looksUp) {
          EXPECT_GT(all.different(id, other, 0.01f), 100);
        }
        leftOut += drawn ? 0 : samples[id];
        for (std::size_t i = 0; i < some.ids.size(); ++i) {
          if (some.ids[i] != id) continue;
          ASSERT_EQ((some.masks[i] & mark) != 0, !drawn);
        }
      }
      const Counters& counters = some.output.counters;
      EXPECT_EQ(counters.at("mirrors"), budget);
      EXPECT_EQ(counters.at("mirrors_left_out"), 3 - budget);
      EXPECT_EQ(counters.at("environment"), looksUp ? leftOut : 0);
      EXPECT_EQ(counters.at("retraced"), looksUp ? 0 : leftOut);
    }
  }
}

TEST(Planar, MirrorsBeyondTheBudgetShowTheirDiffuseComponentInMirrors) {
  // Within the budget, mirrors reflect each other as ever
  const CornerFrame twice(planarEntry(), R"({"bounces": 2})");
  const CornerFrame three(planarEntry(), R"({"bounces": 2, "max_mirrors": 3})");
  const CornerFrame one(planarEntry(), R"({"bounces": 2, "max_mirrors": 1})");
  const CornerFrame once(planarEntry(), R"({"max_mirrors": 1})");
  for (std::uint32_t id = 1; id <= 3; ++id) {
    EXPECT_EQ(three.different(id, twice), 0);
    EXPECT_EQ(one.different(id, once), 0);
  }
}

TEST(Planar, PlansAFallbackOnlyForMirrorsBeyondTheBudget) {
  const auto planOf = [](const std::string& options) {
    return planarEntry()
        .make(config::parseText(options, "options"))
        ->plan(corner(), test::framesOf(kWidth, kHeight, 1));
  };
  const auto bytes = [](const MethodPlan& plan) {
    std::uint64_t sum = 0;
    for (const PlanItem& item : plan.items) sum += item.bytes;
    return sum;
  };
  const MethodPlan all = planOf("{}");
  for (const char* options :
       {R"({"max_mirrors": 3})", R"({"max_mirrors": 3, "fallback": "traced"})"}) {
    EXPECT_FALSE(planOf(options).trace);
    EXPECT_EQ(bytes(planOf(options)), bytes(all));
    EXPECT_EQ(planOf(options).masks, 0);
  }
  const MethodPlan looksUp = planOf(R"({"max_mirrors": 2})");
  EXPECT_EQ(bytes(looksUp), bytes(all) + cubeMapBytes(256, 8));
  EXPECT_EQ(looksUp.masks, raster::kMaskEnvironment);
  const MethodPlan traces = planOf(R"({"max_mirrors": 2, "fallback": "traced"})");
  EXPECT_TRUE(traces.trace);
  EXPECT_EQ(traces.masks, raster::kMaskRetraced);
}

// Two mirrors in one plane come apart: each reflects the other, with a level for it.
TEST(Planar, MirrorsOfOnePlaneMayComeApart) {
  test::SceneBuilder builder;
  builder.constantEnvironment(Vec3(0.25f));
  const auto plane = [] { return scene::makePlane({2.0f, 12.0f}, {1, 1}, scene::UvMode::Unit); };
  const int mirror = builder.reflective(0.8f);
  builder.add(plane(), mirror);
  const int moving = builder.add(plane(), mirror);
  builder.move(moving, Vec3(0.0f, 1.0f, 0.0f), 1.0f);
  test::GlStage stage(builder.scene(), test::framesOf(kWidth, kHeight, 1));
  const std::string options = R"({"bounces": 2})";
  test::GlMethod method(stage, planarEntry(), options);
  const scene::Camera between =
      scene::lookAt({0.0f, 0.5f, 2.5f}, {0.0f, 0.3f, 0.0f}, {0.0f, 1.0f, 0.0f}, 0.9f);
  EXPECT_EQ(method.render(between).counters.at("mirrored_views"), 1u);
  const std::vector<int> changed = stage.moveTo(1.0);
  EXPECT_GT(method.render(between, changed).counters.at("mirrored_views"), 2u);
  const std::vector<float> drawn = raster::readRgba(stage.gbuffer.reflection);
  const std::vector<std::uint32_t> ids = raster::readIds(stage.gbuffer.object);
  test::GlMethod(stage, test::methodNamed("traced"), options).render(between);
  const std::vector<float> traced = raster::readRgba(stage.gbuffer.reflection);
  int different = 0;
  for (std::size_t i = 0; i < ids.size(); ++i)
    different += ids[i] != 0 && std::abs(drawn[4 * i] - traced[4 * i]) > 0.01f ? 1 : 0;
  EXPECT_LT(different, 100);
}

TEST(Planar, FollowsAMirrorThatMoves) {
  test::SceneBuilder builder;
  builder.constantEnvironment(Vec3(0.25f));
  const int mirror = builder.add(scene::makePlane({3.0f, 3.0f}, {1, 1}, scene::UvMode::Unit),
                                 builder.reflective(1.0f));
  builder.add(scene::makeSphere(0.4f, 64, 32, scene::UvMode::Unit), builder.diffuse(Vec3(0.0f)),
              translation({0.0f, 0.5f, 0.0f}));
  builder.move(mirror, Vec3(0.0f, -1.0f, 0.0f), 1.0f);
  test::GlStage stage(builder.scene(), test::framesOf(kWidth, kHeight, 1));
  test::GlMethod method(stage, planarEntry());
  const scene::Camera above =
      scene::lookAt({0.0f, 2.0f, 3.0f}, {0.0f, 0.0f, 0.0f}, {0.0f, 1.0f, 0.0f}, 0.9f);
  const auto meanRow = [&] {
    const std::vector<float> shown = raster::readRgba(stage.gbuffer.reflection);
    const std::vector<std::uint32_t> ids = raster::readIds(stage.gbuffer.object);
    double sum = 0.0;
    double count = 0.0;
    for (std::size_t i = 0; i < ids.size(); ++i) {
      if (ids[i] != 1 || shown[4 * i] > 0.1f) continue;  // dark: the ball's image
      sum += static_cast<double>(i / kWidth);
      count += 1.0;
    }
    EXPECT_GT(count, 100.0);
    return sum / count;
  };
  const FrameOutput output = method.render(above);
  EXPECT_EQ(output.counters.at("mirrors"), 1u);
  EXPECT_EQ(output.counters.at("mirrored_views"), 1u);
  const double before = meanRow();
  const std::vector<int> changed = stage.moveTo(1.0);
  method.render(above, changed);
  EXPECT_GT(meanRow(), before + 10.0);
}

}  // namespace
}  // namespace catoptric::methods
