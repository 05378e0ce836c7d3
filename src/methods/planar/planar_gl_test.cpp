#include "methods/planar/planar.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "frame/test_scenes.h"
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
  if (ggx) builder.scene().materials.back().lobe = scene::LobeModel::Ggx;

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
