// Lobes beside lamps gain no light.
#include <gtest/gtest.h>

#include "methods/second_order/test_comparison.h"

namespace catoptric::methods::second_order {
namespace {

/// Light that all samples reflect, of what Embree's rays find there.
double lightShare(const Comparison& frame) {
  return frame.light / frame.tracedLight;
}

struct LampScene {
  const char* name;
  float roughness;
  bool ball;     // the reflector: a ball on the floor, or the floor
  float radius;  // of the lamps, metres
  int lamps;
};

class Lamps : public testing::TestWithParam<LampScene> {};

/// A reflector before a dark wall, with lamps 20 times white that stand free before both.
scene::Scene darkRoom(const LampScene& what) {
  const scene::UvMode uv = scene::UvMode::Metres;
  test::SceneBuilder builder;
  const int glossy = builder.reflective(1.0f, what.roughness);
  const int dark = builder.diffuse(Vec3(0.05f));
  builder.add(scene::makePlane({6.0f, 6.0f}, {1, 1}, uv), what.ball ? dark : glossy, Mat4(1.0f));
  if (what.ball)
    builder.add(scene::makeSphere(0.6f, 96, 48, uv), glossy, test::translation({0.2f, 0.6f, 0.3f}));
  builder.add(scene::makeBox({.size = {6.0f, 3.0f, 0.1f}}, uv), dark,
              test::translation({0.0f, 1.5f, -2.5f}));
  const int lamp = builder.diffuse(Vec3(0.0f), Vec3(20.0f));
  for (int i = 0; i < what.lamps; ++i)
    builder.add(scene::makeSphere(what.radius, 24, 12, uv), lamp,
                test::translation({-0.8f + 0.7f * static_cast<float>(i), 0.45f,
                                   what.ball ? 1.1f : -0.6f + 0.3f * static_cast<float>(i)}));
  builder.constantEnvironment(Vec3(0.02f));
  return builder.scene();
}

TEST_P(Lamps, ReflectAsMuchLightAsIsThere) {
  const scene::Camera camera = cameraAt({0.4f, 1.4f, 3.4f}, {0.0f, 0.3f, -0.2f});
  const Comparison frame(darkRoom(GetParam()), camera, R"({"probes": 16})");
  EXPECT_NEAR(lightShare(frame), 1.0, 0.02);
}

INSTANTIATE_TEST_SUITE_P(Scenes, Lamps,
                         testing::Values(LampScene{"floor15", 0.15f, false, 0.08f, 1},
                                         LampScene{"floor30", 0.3f, false, 0.08f, 1},
                                         LampScene{"floor50", 0.5f, false, 0.08f, 1},
                                         LampScene{"floors3", 0.3f, false, 0.04f, 3},
                                         LampScene{"ball20", 0.2f, true, 0.08f, 2},
                                         LampScene{"ball40", 0.4f, true, 0.05f, 3}),
                         [](const auto& scene) { return std::string(scene.param.name); });

}  // namespace
}  // namespace catoptric::methods::second_order
