#include "methods/screen_space/second_layer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "core/error.h"
#include "frame/test_scenes.h"
#include "methods/screen_space/screen_space.h"
#include "methods/testing/gl_harness.h"
#include "raster/test_support.h"

namespace catoptric::methods {
namespace {

using screen_space::SecondLayer;
using test::rotation;
using test::translation;

constexpr int kColumns = 120;
constexpr int kRows = 90;

/// A plane that faces +z.
Mat4 facing(const Vec3& centre) {
  return translation(centre) * test::facingZ();
}

scene::Mesh plane(float width, float height) {
  return scene::makePlane({width, height}, {1, 1}, scene::UvMode::Unit);
}

scene::Camera ahead() {
  return scene::lookAt({0.0f, 0.0f, 3.0f}, {0.0f, 0.0f, 0.0f}, {0.0f, 1.0f, 0.0f}, 1.0f);
}

/// Both layers: ids, 0 where there is nothing, and metres along the axis.
struct Layers {
  std::vector<std::uint32_t> ids;
  std::vector<float> metres;
  std::vector<float> diffuse;
  std::vector<std::uint32_t> secondIds;
  std::vector<float> secondMetres;
  std::vector<float> secondColours;

  Layers(test::GlStage& stage, float separation) {
    const scene::Camera camera = ahead();
    stage.timer.beginFrame(1);
    stage.draw(camera);
    const int width = stage.gbuffer.sampleWidth();
    const int height = stage.gbuffer.sampleHeight();
    SecondLayer layer(width, height);
    Services services = stage.services();
    layer.draw(services, camera.nearMetres, separation);
    stage.context.check("the second layer");
    const auto inMetres = [&](std::vector<float> depths) {
      for (float& depth : depths) depth = depth > 0.0f ? camera.nearMetres / depth : 0.0f;
      return depths;
    };
    ids = raster::readIds(stage.gbuffer.object);
    metres = inMetres(raster::readDepth(stage.gbuffer.depth));
    diffuse = raster::readRgba(stage.gbuffer.diffuse);
    secondMetres = inMetres(raster::readDepth(layer.depth()));
    secondColours = raster::readRgba(layer.colour());
    const auto surfaces = layer.surface().read<std::uint32_t>(0, GL_RG_INTEGER, GL_UNSIGNED_INT, 2);
    for (std::size_t i = 0; i < secondMetres.size(); ++i)
      secondIds.push_back(secondMetres[i] > 0.0f ? surfaces[2 * i] : 0u);
  }
};

constexpr std::uint32_t kBox = 1;
constexpr std::uint32_t kNear = 2;
constexpr std::uint32_t kWall = 4;

/// A box, 3 m away, whose back is culled; a smaller plane at 3.45 m; one at 4 m whose alpha mask
/// cuts it out; a wall at 5 m that moves away by 1 m in a second.
scene::Scene rowOfSurfaces() {
  test::SceneBuilder builder;
  builder.constantEnvironment(Vec3(1.0f));
  builder.add(scene::makeBox({}, scene::UvMode::Unit), builder.diffuse(Vec3(0.2f)),
              translation({0.0f, 0.0f, -0.2f}) * glm::scale(Mat4(1.0f), Vec3(1.0f, 1.0f, 0.4f)));
  builder.add(plane(0.8f, 0.8f), builder.diffuse(Vec3(0.1f, 0.2f, 0.7f)),
              facing({0.0f, 0.0f, -0.45f}));
  const int mask = builder.diffuse(Vec3(1.0f));
  builder.scene().materials[mask].alphaMode = scene::AlphaMode::Mask;
  builder.scene().materials[mask].baseAlpha = 0.2f;
  builder.add(plane(20.0f, 20.0f), mask, facing({0.0f, 0.0f, -1.0f}));
  scene::BoxShape front{.size = Vec3(20.0f, 20.0f, 1.0f)};
  front.faces = {false, false, false, false, true, false};
  const int wall =
      builder.add(scene::makeBox(front, scene::UvMode::Unit),
                  builder.diffuse(Vec3(0.7f, 0.3f, 0.2f)), translation({0.0f, 0.0f, -2.5f}));
  builder.move(wall, {0.0f, 0.0f, -1.0f}, 1.0f);
  return builder.scene();
}

/// What the second layer must hold behind the box.
struct Expected {
  std::uint32_t within = 0;  ///< id behind the smaller plane's outline
  std::uint32_t around = 0;
  float wallMetres = 5.0f;
};

void expectBehindBox(const Layers& layers, const Expected& expected) {
  const Mat3 rayFromSample = scene::rayFromPixel(ahead(), 2 * kColumns, 2 * kRows);
  std::vector<int> seen(5);
  for (std::size_t i = 0; i < layers.ids.size(); ++i) {
    if (layers.ids[i] != kBox) {
      ASSERT_EQ(layers.ids[i], kWall);
      ASSERT_EQ(layers.secondIds[i], 0u);
      ASSERT_EQ(layers.secondColours[4 * i + 3], -1.0f);
      continue;
    }
    const Vec3 ray = rayFromSample * Vec3(static_cast<float>(i % (2 * kColumns)) + 0.5f,
                                          static_cast<float>(i / (2 * kColumns)) + 0.5f, 1.0f);
    const float aside = 3.45f * std::max(std::abs(ray.x), std::abs(ray.y));
    if (std::abs(aside - 0.4f) < 1e-3f) continue;
    const std::uint32_t id = aside < 0.4f ? expected.within : expected.around;
    ++seen[id];
    ASSERT_EQ(layers.secondIds[i], id);
    const float metres = id == kNear ? 3.45f : id == kWall ? expected.wallMetres : 0.0f;
    ASSERT_NEAR(layers.secondMetres[i], metres, 1e-3f);
    if (id != kWall) continue;
    // Shaded as where it is seen in the corner of the frame
    for (std::size_t c = 0; c < 4; ++c)
      ASSERT_NEAR(layers.secondColours[4 * i + c], layers.diffuse[c], 1e-5f);
  }
  EXPECT_GT(seen[expected.within], 500);
  EXPECT_GT(seen[expected.around], 500);
}

TEST(SecondLayer, IsTheNearestSurfaceBeyondTheSeparation) {
  test::GlStage stage(rowOfSurfaces(), test::framesOf(kColumns, kRows, 2));
  expectBehindBox({stage, 0.1f}, {.within = kNear, .around = kWall});
  expectBehindBox({stage, 0.5f}, {.within = kWall, .around = kWall});
  expectBehindBox({stage, 2.5f}, {});
  stage.moveTo(1.0);
  expectBehindBox({stage, 2.5f}, {.within = kWall, .around = kWall, .wallMetres = 6.0f});
}

// Also not where a floor is seen edge-on.
TEST(SecondLayer, ConvexObjectsAreNotBehindThemselves) {
  test::SceneBuilder builder;
  const int grey = builder.diffuse(Vec3(0.5f));
  builder.add(plane(40.0f, 40.0f), grey, translation({0.0f, -0.02f, 0.0f}));
  builder.add(scene::makeSphere(0.5f, 48, 24, scene::UvMode::Unit), grey);
  builder.add(scene::makeBox({}, scene::UvMode::Unit), grey,
              translation({0.7f, 0.2f, -1.0f}) * rotation(30.0f, {1.0f, 1.0f, 0.0f}) *
                  glm::scale(Mat4(1.0f), Vec3(0.01f, 1.0f, 1.0f)));
  builder.add(plane(20.0f, 20.0f), grey, facing({0.0f, 0.0f, -6.0f}));
  test::GlStage stage(builder.scene(), test::framesOf(kColumns, kRows, 2));
  for (const float separation : {0.0f, 0.05f}) {
    const Layers layers(stage, separation);
    int seen = 0;
    for (std::size_t i = 0; i < layers.ids.size(); ++i) {
      if (layers.secondIds[i] == 0) continue;
      ++seen;
      ASSERT_NE(layers.secondIds[i], layers.ids[i]);
      ASSERT_GE(layers.secondMetres[i], (layers.metres[i] + separation) * (1.0f - 1e-5f));
    }
    EXPECT_GT(seen, 1000);
  }
}

constexpr std::uint32_t kGlass = 1;

/// A mirror on the left shows the poster on the wall behind the pillar, which hides it from the
/// camera.
scene::Scene gallery(float roughness = 0.0f) {
  test::SceneBuilder builder;
  builder.constantEnvironment(Vec3(0.5f, 0.6f, 0.9f));
  builder.add(plane(4.0f, 4.0f), builder.reflective(0.8f, roughness),
              translation({-1.5f, 1.0f, 0.0f}) * rotation(-90.0f, {0.0f, 0.0f, 1.0f}));
  builder.add(plane(8.0f, 8.0f), builder.diffuse(Vec3(0.7f, 0.3f, 0.2f)),
              facing({0.0f, 1.0f, -2.0f}));
  builder.add(plane(0.5f, 1.5f), builder.diffuse(Vec3(0.1f, 0.1f, 0.7f)),
              facing({0.0f, 1.0f, -1.99f}));
  builder.add(scene::makeBox({}, scene::UvMode::Unit), builder.diffuse(Vec3(0.1f, 0.6f, 0.3f)),
              translation({0.0f, 1.0f, -0.5f}) * glm::scale(Mat4(1.0f), Vec3(0.4f, 4.0f, 0.4f)));
  return builder.scene();
}

struct View {
  std::vector<float> reflection;
  std::vector<std::uint32_t> ids;
  std::vector<std::uint16_t> masks;
  Counters counters;

  explicit View(const std::string& options, const std::string& method = "screen_space",
                float roughness = 0.0f) {
    RunSettings settings = test::framesOf(100, 80, 2, true);
    settings.countDisocclusions = method == "screen_space";
    test::GlStage stage(gallery(roughness), settings);
    const scene::Camera camera =
        scene::lookAt({0.0f, 1.0f, 3.0f}, {-0.8f, 1.0f, -2.0f}, {0.0f, 1.0f, 0.0f}, 1.0f);
    counters = test::GlMethod(stage, test::methodNamed(method), options).render(camera).counters;
    reflection = raster::readRgba(stage.gbuffer.reflection);
    ids = raster::readIds(stage.gbuffer.object);
    masks = raster::readMasks(stage.gbuffer.masks);
  }

  static View of(const std::string& more, float roughness = 0.0f) {
    return View("{\"fallback\": \"black\"" + more + "}", "screen_space", roughness);
  }

  Vec3 at(std::size_t i) const {
    return {reflection[4 * i], reflection[4 * i + 1], reflection[4 * i + 2]};
  }
  bool found(std::size_t i) const {
    return ids[i] == kGlass &&
           (masks[i] & (raster::kMaskOffscreen | raster::kMaskBehind | raster::kMaskBackface |
                        raster::kMaskTowardCamera | raster::kMaskSteps)) == 0;
  }
};

bool isPoster(const Vec3& colour) {
  return colour.b > 2.0f * std::max(colour.r, colour.g);
}

struct Posters {
  int all = 0;
  int found = 0;
  int right = 0;
};

/// Samples of the mirror that show the poster, as rays are traced.
Posters postersOf(const View& frame, const View& traced) {
  Posters counted;
  for (std::size_t i = 0; i < frame.ids.size(); ++i) {
    if (frame.ids[i] != kGlass || !isPoster(traced.at(i))) continue;
    ++counted.all;
    counted.found += frame.found(i) ? 1 : 0;
    counted.right += frame.found(i) && isPoster(frame.at(i)) ? 1 : 0;
  }
  return counted;
}

TEST(SecondLayer, ShowsWhatIsHiddenFromTheCamera) {
  const View traced("{}", "traced");
  const View one = View::of("");
  EXPECT_GT(postersOf(one, traced).all, 400);
  EXPECT_EQ(postersOf(one, traced).right, 0);
  for (const char* trace : {"hi_z", "dda"}) {
    SCOPED_TRACE(trace);
    const View two = View::of(", \"layers\": 2, \"trace\": \"" + std::string(trace) + "\"");
    const Posters posters = postersOf(two, traced);
    EXPECT_GT(posters.right, posters.all * 98 / 100);
    EXPECT_LT(two.counters.at("behind"), one.counters.at("behind") / 10);
    EXPECT_GE(one.counters.at("disoccluded") - two.counters.at("disoccluded"),
              static_cast<std::uint64_t>(posters.right));
    EXPECT_LE(two.counters.at("missed_hit"), one.counters.at("missed_hit"));
    EXPECT_LE(two.counters.at("wrong_hit"), one.counters.at("wrong_hit") + 50);
    EXPECT_GE(two.counters.at("second_layer_hits"), static_cast<std::uint64_t>(posters.right));
    int found = 0;
    int different = 0;
    for (std::size_t i = 0; i < two.ids.size(); ++i) {
      // No layer has the side of the pillar that the mirror shows
      if (!two.found(i) || traced.at(i).g > traced.at(i).b) continue;
      ++found;
      different += glm::length(two.at(i) - traced.at(i)) > 0.02f ? 1 : 0;
    }
    EXPECT_LT(different, found / 50);
  }
}

TEST(SecondLayer, BothWaysToFollowARayMeetTheSame) {
  const View coarse = View::of(R"(, "layers": 2)");
  const View fine = View::of(R"(, "layers": 2, "trace": "dda")");
  const View strides = View::of(R"(, "layers": 2, "trace": "dda", "stride": 4)");
  int samples = 0;
  int different = 0;
  int moved = 0;
  for (std::size_t i = 0; i < coarse.ids.size(); ++i) {
    if (coarse.ids[i] != kGlass) continue;
    ++samples;
    different += glm::length(coarse.at(i) - fine.at(i)) > 1e-3f ? 1 : 0;
    moved += glm::length(strides.at(i) - fine.at(i)) > 1e-3f ? 1 : 0;
  }
  EXPECT_LE(different, samples / 1000);
  EXPECT_LE(moved, samples / 20);
}

TEST(SecondLayer, EmptyItChangesNoPixel) {
  const View one = View::of("");
  const View two = View::of(R"(, "layers": 2, "separation": 5)");
  EXPECT_EQ(two.counters.at("second_layer_hits"), 0u);
  EXPECT_EQ(one.masks, two.masks);
  for (std::size_t i = 0; i < one.ids.size(); ++i)
    ASSERT_TRUE(one.ids[i] != kGlass || one.at(i) == two.at(i));
}

// Rays and cones of a rough mirror: the poster's mean colour where both find something.
TEST(SecondLayer, ConesReceiveItsRadiance) {
  const View traced("{}", "traced");
  const View rays = View::of(R"(, "layers": 2, "rays": 32)", 0.1f);
  const View cone = View::of(R"(, "layers": 2, "rays": 32, "glossy": "cone")", 0.1f);
  Vec3 ofRays(0.0f);
  Vec3 ofCones(0.0f);
  int samples = 0;
  for (std::size_t i = 0; i < rays.ids.size(); ++i) {
    if (!rays.found(i) || !cone.found(i) || !isPoster(traced.at(i))) continue;
    ++samples;
    ofRays += rays.at(i);
    ofCones += cone.at(i);
  }
  EXPECT_GT(samples, 400);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(ofCones[c] / ofRays[c], 1.0f, 0.05f) << c;
}

TEST(SecondLayer, IsPlannedOnlyIfAskedFor) {
  const auto bytesOf = [](const char* options) {
    const MethodPlan plan = screenSpaceEntry()
                                .make(config::parseText(options, "test options"))
                                ->plan(gallery(), test::framesOf(64, 64, 1));
    std::map<std::string, std::uint64_t> bytes;
    for (const PlanItem& item : plan.items) bytes[item.kind + " " + item.name] = item.bytes;
    return bytes;
  };
  const auto one = bytesOf("{}");
  const auto two = bytesOf(R"({"layers": 2})");
  EXPECT_FALSE(one.contains("pass second_layer") || one.contains("resource second layer"));
  EXPECT_TRUE(two.contains("pass second_layer"));
  EXPECT_EQ(two.at("resource second layer"), 64u * 64u * 28u);
  EXPECT_NEAR(static_cast<double>(two.at("resource pyramid")),
              2.0 * static_cast<double>(one.at("resource pyramid")), 1.0);
}

TEST(SecondLayer, OptionsWithoutEffectAreErrors) {
  const auto errorOf = [](const char* options) -> std::string {
    try {
      screenSpaceEntry().make(config::parseText(options, "f"));
    } catch (const UsageError& error) {
      return error.what();
    }
    return "";
  };
  using testing::HasSubstr;
  EXPECT_THAT(errorOf(R"({"stride": 4})"),
              testing::AllOf(HasSubstr("f:1: /stride"), HasSubstr(R"("trace": "dda")")));
  EXPECT_THAT(errorOf(R"({"separation": 1})"),
              testing::AllOf(HasSubstr("f:1: /separation"), HasSubstr(R"("layers": 2)")));
  EXPECT_THAT(errorOf(R"({"layers": 3})"), HasSubstr("/layers: 3 is out of range"));
  EXPECT_THAT(errorOf(R"({"thickness": 1e39})"), HasSubstr("/thickness: 1e+39 is too large"));
  EXPECT_EQ(errorOf(R"({"stride": 4, "trace": "dda", "separation": 1, "layers": 2})"), "");
  EXPECT_EQ(errorOf(R"({"stride": 1, "layers": 1})"), "");
}

}  // namespace
}  // namespace catoptric::methods
