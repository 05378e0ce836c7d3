// Several methods in one frame: on its own reflectors each makes the samples that it makes alone.
#include "run/stage/mixed_method.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "core/error.h"
#include "frame/test_scenes.h"
#include "methods/testing/gl_harness.h"
#include "scene/implicit/surface.h"

namespace catoptric::run {
namespace {

using testing::HasSubstr;

/// A room of six colours with a flat mirror, a ball that mirrors and a glossy one; ids 7, 8, 9.
scene::Scene room() {
  test::SceneBuilder builder;
  for (int face = 0; face < 6; ++face) {
    scene::BoxShape wall;
    wall.size = Vec3(4.0f);
    wall.inward = true;
    wall.faces = {};
    wall.faces[face] = true;
    builder.add(scene::makeBox(wall, scene::UvMode::Unit),
                builder.diffuse(Vec3(0.1f), Vec3(0.15f * static_cast<float>(face + 1),
                                                 0.9f - 0.1f * static_cast<float>(face), 0.3f)));
  }
  const Mat4 upright = test::translation({-0.7f, 0.0f, -0.5f}) * test::rotation(90.0f, {1, 0, 0});
  builder.add(scene::makePlane({1.2f, 1.2f}, {1, 1}, scene::UvMode::Unit), builder.reflective(0.8f),
              upright);
  builder.add(scene::makeIcosphere(0.4f, 4, scene::UvMode::Unit), builder.reflective(0.9f),
              test::translation({0.5f, 0.3f, -0.3f}));
  builder.add(scene::makeIcosphere(0.4f, 4, scene::UvMode::Unit), builder.reflective(0.7f, 0.3f),
              test::translation({0.5f, -0.7f, 0.0f}));
  scene::Scene& scene = builder.scene();
  scene.objects[6].name = "pane";
  scene.objects[7].name = "ball mirror";
  scene.objects[8].name = "ball glossy";
  return scene;
}

MethodConfig configOf(const std::string& json) {
  const config::Value root =
      config::parseText(R"({"scene": "room.json", "methods": [)" + json + "]}", "mixture.json");
  return readRunConfig(root, "mixture.json", methods::registry()).methods.front();
}

std::unique_ptr<methods::Method> methodOf(const std::string& json, const scene::Scene& scene,
                                          const methods::RunSettings& settings = {}) {
  return makeMethod(configOf(json), scene, settings, methods::registry());
}

/// One frame: reflection and masks of every sample.
struct Frame {
  std::vector<float> reflection;
  std::vector<std::uint16_t> masks;
  std::vector<std::uint32_t> object;
  methods::FrameOutput output;
  std::vector<frame::StepSample> steps;

  explicit Frame(const std::string& json, const scene::Scene& scene = room()) {
    test::GlStage stage(scene, test::framesOf(96, 96, 2, true));
    test::GlMethod method(stage, methodOf(json, stage.scene, stage.settings));
    const scene::Camera camera =
        scene::lookAt({0.0f, 0.2f, 1.8f}, {0.0f, -0.1f, -0.5f}, {0, 1, 0}, radians(60.0f));
    output = method.render(camera);
    const std::vector<float> first = raster::readRgba(stage.gbuffer.reflection);
    method.render(camera);  // finds the stencil as the first did
    reflection = raster::readRgba(stage.gbuffer.reflection);
    EXPECT_EQ(reflection, first);
    masks = raster::readMasks(stage.gbuffer.masks);
    object = raster::readIds(stage.gbuffer.object);
    steps = stage.timer.samples();
  }

  /// Samples of an object that differ from another frame's, of how many.
  std::pair<int, int> differing(const Frame& other, std::uint32_t id) const {
    int differ = 0;
    int all = 0;
    for (std::size_t at = 0; at < object.size(); ++at) {
      if (object[at] != id) continue;
      ++all;
      const bool same =
          masks[at] == other.masks[at] &&
          std::equal(&reflection[4 * at], &reflection[4 * at] + 3, &other.reflection[4 * at]);
      differ += same ? 0 : 1;
    }
    return {differ, all};
  }
};

/// Mean absolute difference of radiance over an object's samples.
double meanDifference(const Frame& a, const Frame& b, std::uint32_t id) {
  double sum = 0.0;
  int count = 0;
  for (std::size_t at = 0; at < a.object.size(); ++at) {
    if (a.object[at] != id) continue;
    for (std::size_t c = 4 * at; c < 4 * at + 3; ++c)
      sum += std::abs(static_cast<double>(a.reflection[c]) - static_cast<double>(b.reflection[c]));
    count += 3;
  }
  return sum / count;
}

constexpr std::uint32_t kPane = 7;
constexpr std::uint32_t kMirror = 8;
constexpr std::uint32_t kGlossy = 9;

TEST(Mixture, EachMethodMakesItsReflectorsSamples) {
  const Frame looked(R"("environment_map")");
  const Frame traced(R"("traced")");
  const Frame clustered(R"("second_order")");
  const Frame mixed(
      R"({"method": "environment_map", "reflectors": {"ball*": "second_order", "pane": "traced"}})");
  EXPECT_EQ(mixed.differing(traced, kPane).first, 0);
  // Bins of normals are shared out among the reflectors at hand: fewer of them, other clusters
  for (const std::uint32_t id : {kMirror, kGlossy}) {
    const double difference = meanDifference(mixed, clustered, id);
    EXPECT_LT(difference, 0.2 * meanDifference(looked, clustered, id)) << id;
    EXPECT_LT(difference, 0.02) << id;
  }
  // The methods differ there, so that a mix-up shows
  EXPECT_GT(traced.differing(clustered, kGlossy).first, 500);
  EXPECT_GT(traced.differing(looked, kPane).first, 500);

  // Every method can be the one beside others, and first or last
  const Frame other(
      R"({"method": "traced", "reflectors": {"pane": "perturbation", "ball glossy": "environment_map"}})");
  EXPECT_EQ(other.differing(traced, kMirror).first, 0);
  EXPECT_EQ(other.differing(looked, kGlossy).first, 0);
  const Frame moved(R"({"method": "perturbation", "unsupported": "traced"})");
  EXPECT_EQ(other.differing(moved, kPane).first, 0);
  EXPECT_EQ(moved.differing(traced, kGlossy).first, 0);
}

/// The samples that screen_space leaves are those of the whole other method, bit for bit; the
/// others are screen_space's; and masks keep the reasons.
TEST(Mixture, LeftSamplesAreTheFallbacksOwn) {
  const Frame alone(R"({"method": "screen_space", "fallback": "black"})");
  for (const std::string fallback :
       {R"("billboards")", R"("depth_impostors")",
        R"({"method": "environment_map", "proxy": "box"})", R"({"method": "traced"})",
        R"({"method": "planar", "unsupported": "traced"})"}) {
    SCOPED_TRACE(fallback);
    const Frame whole(fallback);
    const Frame hybrid(R"({"method": "screen_space", "fallback": )" + fallback + "}");
    std::uint64_t left = 0;
    int wrong = 0;
    for (std::size_t at = 0; at < hybrid.object.size(); ++at) {
      const bool taken = (hybrid.masks[at] & raster::kMaskFallback) != 0;
      const Frame& owner = taken ? whole : alone;
      const int marks =
          taken ? alone.masks[at] | whole.masks[at] | raster::kMaskFallback : alone.masks[at];
      left += taken ? 1 : 0;
      wrong += hybrid.masks[at] == marks &&
                       std::equal(&hybrid.reflection[4 * at], &hybrid.reflection[4 * at] + 3,
                                  &owner.reflection[4 * at])
                   ? 0
                   : 1;
    }
    EXPECT_EQ(wrong, 0);
    EXPECT_GT(left, 500u);
    EXPECT_EQ(hybrid.output.counters.at("fallback_samples"), left);
    EXPECT_EQ(hybrid.output.counters.at("hits"), alone.output.counters.at("hits"));
    EXPECT_EQ(hybrid.object, whole.object);
  }
}

/// screen_space would mirror what its rays hit, in the midst of what the other method refracts.
TEST(Mixture, AFallbackRendersAllOfWhatRefracts) {
  scene::Scene glass = room();
  glass.materials[glass.objects[kMirror - 1].material].refraction = 1.5f;
  const Frame traced(R"({"method": "traced", "bounces": 2})", glass);
  const Frame mirrored(R"("traced")");
  const Frame hybrid(
      R"({"method": "screen_space", "fallback": {"method": "traced", "bounces": 2}})", glass);
  int wrong = 0;
  int mirrors = 0;
  for (std::size_t at = 0; at < hybrid.object.size(); ++at) {
    if (hybrid.object[at] != kMirror) continue;
    ++mirrors;
    const bool same = (hybrid.masks[at] & raster::kMaskFallback) != 0 &&
                      std::equal(&hybrid.reflection[4 * at], &hybrid.reflection[4 * at] + 3,
                                 &traced.reflection[4 * at]);
    wrong += same ? 0 : 1;
  }
  EXPECT_EQ(wrong, 0);
  EXPECT_GT(mirrors, 500);
  EXPECT_GT(traced.differing(mirrored, kMirror).first, 500);
  EXPECT_EQ(hybrid.output.counters.at("refraction_mirrored"), 0u);
}

TEST(Mixture, AFallbackServesTheEntrysOwnReflectorsAlone) {
  const Frame looked(R"("environment_map")");
  const Frame traced(R"("traced")");
  const Frame hybrid(
      R"({"method": "screen_space", "fallback": {"method": "traced"}, "reflectors": {"ball*": "environment_map"}})");
  for (const std::uint32_t id : {kMirror, kGlossy})
    EXPECT_EQ(hybrid.differing(looked, id).first, 0);
  std::uint64_t left = 0;
  int wrong = 0;
  for (std::size_t at = 0; at < hybrid.object.size(); ++at) {
    if ((hybrid.masks[at] & raster::kMaskFallback) == 0) continue;
    ++left;
    const bool same = hybrid.object[at] == kPane &&
                      std::equal(&hybrid.reflection[4 * at], &hybrid.reflection[4 * at] + 3,
                                 &traced.reflection[4 * at]);
    wrong += same ? 0 : 1;
  }
  EXPECT_EQ(wrong, 0);
  EXPECT_GT(left, 100u);
  EXPECT_EQ(hybrid.output.counters.at("fallback_samples"), left);
}

TEST(Mixture, AMixtureAsFallbackNamesItsSteps) {
  const Frame hybrid(
      R"({"method": "screen_space", "fallback": {"method": "planar", "unsupported": "traced"}})");
  const auto has = [&](const std::string& step) {
    return std::ranges::find(hybrid.steps, step, &frame::StepSample::step) != hybrid.steps.end();
  };
  EXPECT_TRUE(has("march"));
  EXPECT_TRUE(has("planar.traced.trace"));
}

TEST(Mixture, OneMethodForAllIsThatMethod) {
  const Frame traced(R"("traced")");
  const Frame given(R"({"method": "environment_map", "reflectors": {"*": "traced"}})");
  EXPECT_EQ(given.reflection, traced.reflection);
  EXPECT_EQ(given.masks, traced.masks);
  EXPECT_EQ(given.output.counters, traced.output.counters);
}

TEST(Mixture, KindsOfReflectorsAreWeakerThanNames) {
  const auto fills = [](const std::string& method, const std::string& rules) {
    const std::string json = R"({"method": ")" + method + R"(", "reflectors": {)" + rules + "}}";
    std::vector<std::string> parts;
    for (const methods::PlanItem& item : methodOf(json, room())->plan(room(), {}).items)
      if (item.kind == "method") parts.push_back(item.name + " " + item.reason);
    return parts;
  };
  using testing::ElementsAre, testing::StartsWith;
  EXPECT_THAT(
      fills("planar", R"("curved": "second_order", "glossy": "glossy_lod")"),
      ElementsAre(StartsWith("planar fills pane ("), "second_order fills ball mirror (\"curved\")",
                  "glossy_lod fills ball glossy (\"glossy\")"));
  EXPECT_THAT(fills("traced", R"("glossy": "glossy_lod", "ball*": "second_order")"),
              ElementsAre(StartsWith("traced fills pane ("),
                          "second_order fills ball mirror, ball glossy (\"ball*\")"));
  EXPECT_THAT(
      fills("traced", R"("planar": "traced", "*": "environment_map", "glossy": "glossy_lod")"),
      ElementsAre(StartsWith("traced fills pane ("), "environment_map fills ball mirror (\"*\")",
                  "glossy_lod fills ball glossy (\"glossy\")"));

  // Each kind's samples are those that its method renders alone
  const Frame mixed(R"({"method": "traced", "reflectors": {"planar": "environment_map"}})");
  EXPECT_EQ(mixed.differing(Frame(R"("environment_map")"), kPane).first, 0);
  EXPECT_EQ(mixed.differing(Frame(R"("traced")"), kMirror).first, 0);
}

TEST(Mixture, MisspelledKindsAreSuggested) {
  EXPECT_THAT(
      [] { methodOf(R"({"method": "traced", "reflectors": {"glosy": "planar"}})", room()); },
      testing::ThrowsMessage<UsageError>(HasSubstr(R"(did you mean "glossy"?)")));
}

TEST(Mixture, AKindThatIsAlsoAnObjectsNameIsAnError) {
  scene::Scene scene = room();
  const std::string config = R"({"method": "traced", "reflectors": {"glossy": "environment_map"}})";
  EXPECT_NO_THROW(methodOf(config, scene));
  scene.objects[0].name = "glossy";  // even one that does not reflect
  EXPECT_THAT([&] { methodOf(config, scene); },
              testing::ThrowsMessage<UsageError>(
                  HasSubstr(R"("glossy" is both a kind of reflectors and the name of an object)")));
  scene.objects[8].name = "glossy ball";
  EXPECT_NO_THROW(
      methodOf(R"({"method": "traced", "reflectors": {"glossy*": "environment_map"}})", scene));
}

TEST(Mixture, MethodsOfWholeImagesAreRefusedWhereNoReflectorIsTheirs) {
  scene::Scene scene = room();
  scene.objects.pop_back();  // the glossy one
  for (const char* config : {R"({"method": "traced", "reflectors": {"glossy": "reference"}})",
                             R"({"method": "reference", "reflectors": {"glossy": "traced"}})",
                             R"({"method": "screen_space", "fallback": "reference"})"})
    EXPECT_THAT(
        [&] { methodOf(config, scene); },
        testing::ThrowsMessage<UsageError>(HasSubstr("reference renders only whole images")));
}

TEST(Mixture, CountersAndStepsAreNamedAfterTheirMethod) {
  const Frame mixed(R"({"method": "environment_map", "reflectors": {
      "pane": "second_order", "ball mirror": {"method": "second_order", "bin_density": 2}}})");
  EXPECT_GT(mixed.output.counters.at("second_order.planar_samples"), 500u);
  EXPECT_GT(mixed.output.counters.at("second_order_2.clusters"), 1u);
  EXPECT_GT(mixed.output.counters.at("environment"), 500u);
  for (const char* step :
       {"second_order.cluster", "second_order_2.cluster", "cube_map", "second_order.cube_map"}) {
    EXPECT_TRUE(std::ranges::any_of(mixed.steps, [&](const frame::StepSample& sample) {
      return sample.step == step;
    })) << step;
  }
}

TEST(Mixture, TablesOfOneNameAreNamedAfterTheirMethod) {
  const Frame mixed(R"({"method": "reprojection", "reflectors": {
      "pane": "image_warp", "ball mirror": {"method": "reprojection", "epsilon": 0.1}}})");
  std::vector<std::string> names;
  for (const methods::Table& table : mixed.output.tables) names.push_back(table.name());
  EXPECT_THAT(names, testing::UnorderedElementsAre("keyframes", "reprojection_2.keyframes",
                                                   "reprojection_3.keyframes"));
}

TEST(Mixture, WhatAMethodCannotDoIsFilledAndCounted) {
  const Frame looked(R"({"method": "environment_map", "face_size": 256})");
  const Frame filled(R"({"method": "perturbation", "unsupported": "environment_map"})");
  std::uint64_t samples = 0;
  for (const std::uint32_t id : {kMirror, kGlossy}) {
    const auto [differ, all] = filled.differing(looked, id);
    EXPECT_EQ(differ, 0);
    samples += static_cast<std::uint64_t>(all);
  }
  EXPECT_EQ(filled.output.counters.at("unsupported_reflector"), samples);
  EXPECT_EQ(filled.output.counters.at("environment_map.environment"), samples);
  EXPECT_GT(filled.output.counters.at("triangles"), 0u);

  const auto refused = methodOf(R"("perturbation")", room())->unsupported(room());
  ASSERT_EQ(refused.size(), 2u);
  EXPECT_EQ(refused[0].object, 8);
  // A method that is named for what it cannot do refuses that alone
  const auto named =
      methodOf(R"({"method": "traced", "reflectors": {"ball glossy": "perturbation"}})", room());
  const auto byName = named->unsupported(room());
  ASSERT_EQ(byName.size(), 1u);
  EXPECT_EQ(byName[0].object, 9);
}

/// A method that draws nothing, restarts every few frames, and notes what frames it is given.
template <int kEvery>
class Listener : public methods::Method {
 public:
  static inline std::vector<bool> givenChangedSamples;

  methods::MethodPlan plan(const scene::Scene&, const methods::RunSettings&) const override {
    methods::MethodPlan plan;
    plan.gbuffer = true;
    plan.trace = kEvery == 2;
    plan.bvh = kEvery == 2 ? trace::BvhPolicy::Refit : trace::BvhPolicy::RebuildLow;
    plan.masks = kEvery == 2 ? raster::kMaskSky : raster::kMaskClamped;
    return plan;
  }
  void render(const methods::FrameInput& input, methods::Services&,
              methods::FrameOutput&) override {
    givenChangedSamples.push_back(input.changedSamples.has_value());
  }
  bool restartsAt(const scene::CameraPath&, int number) const override {
    return (number - 1) % kEvery == 0;
  }

  static methods::MethodEntry entry(const std::string& id) {
    return {id,
            "",
            "",
            {},
            {},
            {},
            {},
            {},
            std::ranges::find(methods::registry(), "traced", &methods::MethodEntry::id)->options,
            [](const config::Value&) -> std::unique_ptr<methods::Method> {
              return std::make_unique<Listener>();
            }};
  }
};

std::unique_ptr<methods::Method> listeners(const scene::Scene& scene,
                                           const std::string& first = "even",
                                           const std::string& other = "third") {
  const std::vector<methods::MethodEntry> registry = {Listener<2>::entry("even"),
                                                      Listener<3>::entry("third")};
  const config::Value root =
      config::parseText(R"({"scene": "a", "methods": [{"method": ")" + first +
                            R"(", "reflectors": {"pane": ")" + other + R"("}}]})",
                        "f");
  return makeMethod(readRunConfig(root, "f", registry).methods.front(), scene, {}, registry);
}

TEST(Mixture, RestartsWhereAllItsMethodsDo) {
  const std::unique_ptr<methods::Method> mixed = listeners(room());
  const auto path = scene::cameraPath("", room());
  for (int number = 1; number <= 13; ++number)
    EXPECT_EQ(mixed->restartsAt(*path, number), number % 6 == 1) << number;
}

TEST(Mixture, NeedsWhatAnyOfItsMethodsNeeds) {
  for (const bool turned : {false, true}) {
    const scene::Scene scene = room();
    const methods::MethodPlan plan =
        listeners(scene, turned ? "third" : "even", turned ? "even" : "third")->plan(scene, {});
    EXPECT_TRUE(plan.gbuffer && plan.trace);
    EXPECT_EQ(plan.bvh, trace::BvhPolicy::RebuildLow);
    EXPECT_EQ(plan.masks, raster::kMaskSky | raster::kMaskClamped);
  }
}

// Another method has written beside a part's own samples since it saw them last.
TEST(Mixture, ItsMethodsAreNotToldThatLittleChanged) {
  test::GlStage stage(room(), test::framesOf(16, 16, 1));
  test::GlMethod method(stage, listeners(stage.scene));
  raster::Region part(16, 16);
  part.add({0, 0, 8, 8});
  method.render({});
  method.render({}, {}, part);
  const std::vector<bool> never = {false, false};
  EXPECT_EQ(Listener<2>::givenChangedSamples, never);
  EXPECT_EQ(Listener<3>::givenChangedSamples, never);
}

std::string errorOf(const std::string& json) {
  try {
    methodOf(json, room());
  } catch (const UsageError& error) {
    return error.what();
  }
  return "no error";
}

TEST(Mixture, WrongNamesAreErrors) {
  const auto withRule = [](const std::string& name, const std::string& method) {
    return R"({"method": "traced", "reflectors": {")" + name + R"(": ")" + method + R"("}})";
  };
  EXPECT_THAT(errorOf(withRule("ball miror", "environment_map")),
              HasSubstr(R"(did you mean "ball mirror"?)"));
  EXPECT_THAT(errorOf(withRule("object0", "environment_map")), HasSubstr("does not reflect"));
  EXPECT_THAT(errorOf(withRule("lamp*", "environment_map")), HasSubstr("mixture.json:1: "));
  EXPECT_THAT(errorOf(withRule("pane", "environment_mop")),
              HasSubstr(R"(did you mean "environment_map"?)"));
  EXPECT_THAT(errorOf(withRule("p*ne", "traced")), HasSubstr("at its end"));
  EXPECT_THAT(errorOf(withRule("pane", "reference")), HasSubstr("renders only whole images"));
  EXPECT_THAT(errorOf(R"({"method": "traced", "unsupported": "traced"})"),
              HasSubstr("unsupported"));
  EXPECT_THAT(errorOf(R"({"method": "traced", "fallback": "second_order"})"),
              HasSubstr("fallback"));
  EXPECT_THAT(
      errorOf(R"({"method": "screen_space", "fallback": "tracd"})"),
      HasSubstr(R"X("tracd" is not allowed (did you mean "traced"?); allowed: environment_map)X"));
  EXPECT_THAT(errorOf(R"({"method": "screen_space", "fallback":
                          {"method": "traced", "reflectors": {"*": "screen_space"}}})"),
              HasSubstr("would find nothing there either"));
  EXPECT_THAT(errorOf(R"({"method": "screen_space", "fallback": {"method": "screen_space"}})"),
              HasSubstr("would find nothing there either"));
  EXPECT_THAT(
      errorOf(R"({"method": "screen_space", "fallback": {"method": "traced", "alpha": 1}})"),
      HasSubstr("alpha"));
  EXPECT_THAT(errorOf(R"({"method": "screen_space", "fallback":
                          {"method": "traced", "name": "rest"}})"),
              HasSubstr("a fallback has no folder of its own"));
  EXPECT_THAT(errorOf(R"({"method": "screen_space", "fallback": 3})"),
              HasSubstr("neither a method's name nor an object"));
  EXPECT_THAT(errorOf(R"({"method": "traced", "reflectors":
                          {"pane": {"method": "screen_space", "fallback": "second_order"}}})"),
              HasSubstr("allowed: environment_map, traced, black"));
  EXPECT_THAT(errorOf(R"({"method": "traced", "reflectors":
                          {"pane": {"method": "perturbation", "unsupported": "traced"}}})"),
              HasSubstr(R"("unsupported" is for entries of methods)"));
  EXPECT_THAT(errorOf(R"({"method": "traced", "reflectors":
                          {"curved": {"method": "second_order", "bins": 1}}})"),
              testing::AllOf(HasSubstr("unknown name \"bins\""), HasSubstr("bin_density"),
                             testing::Not(HasSubstr("unsupported"))));
}

}  // namespace
}  // namespace catoptric::run
