#include "trace/lobes/environment_levels.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "frame/test_environment.h"
#include "frame/test_scenes.h"
#include "scene/animate.h"
#include "scene/reflectance.h"
#include "trace/embree/trace_scene.h"
#include "trace/lobes/reflect.h"

namespace catoptric {
namespace {

/// Radiance of a direction; y is up.
using Sky = std::function<Vec3(const Vec3&)>;

/// An image file of a sky, each pixel that of its middle.
scene::Environment skyFile(const std::string& name, int width, int height, const Sky& sky) {
  scene::Environment environment;
  environment.type = scene::EnvironmentType::File;
  environment.file =
      test::writeEnvironment("catoptric_levels_" + name + ".exr", width, height, sky);
  environment.scale = 2.0f;
  return environment;
}

std::shared_ptr<const frame::EnvironmentLight> light(const scene::Environment& environment) {
  return std::make_shared<frame::EnvironmentLight>(environment);
}

std::vector<Vec3> directions(std::size_t count) {
  std::mt19937 random(11);
  std::normal_distribution<float> normal;
  std::vector<Vec3> all;
  while (all.size() < count) {
    const Vec3 d(normal(random), normal(random), normal(random));
    if (glm::length(d) > 1e-2f) all.push_back(glm::normalize(d));
  }
  return all;
}

TEST(EnvironmentLevels, KeepAWhiteSkyWhite) {
  const trace::EnvironmentLevels levels(
      light(skyFile("white", 37, 19, [](const Vec3&) { return Vec3(0.5f); })));
  EXPECT_EQ(levels.levels(), 6);  // 37 x 19, 18 x 9, 9 x 4, 4 x 2, 2 x 1, 1 x 1
  for (const Vec3& d : directions(100))
    for (const float solidAngle : {0.0f, 0.01f, 0.3f, 5.0f, 4.0f * kPi})
      EXPECT_NEAR(levels.radiance(d, solidAngle).x, 1.0f, 1e-5f) << solidAngle;
}

TEST(EnvironmentLevels, EndAtTheMeanOverTheSphere) {
  // cos^2 of the angle from the zenith has the mean 1/3; plain means of texels would give 1/2.
  const trace::EnvironmentLevels levels(
      light(skyFile("zenith", 250, 125, [](const Vec3& d) { return Vec3(d.y * d.y); })));
  for (const Vec3& d : directions(20))
    EXPECT_NEAR(levels.radiance(d, 1000.0f).x, 2.0f / 3.0f, 1e-3f);
}

TEST(EnvironmentLevels, AreTheSkyItselfForNarrowRays) {
  const auto sky = light(skyFile("stripes", 64, 32, [](const Vec3& d) {
    return Vec3(0.5f + 0.5f * std::sin(20.0f * d.x), 0.5f + 0.5f * d.y, 0.25f);
  }));
  const trace::EnvironmentLevels levels(sky);
  for (const Vec3& d : directions(200)) {
    EXPECT_EQ(levels.radiance(d, 0.0f), sky->radiance(d));
    EXPECT_EQ(levels.radiance(d, 1e-5f), sky->radiance(d));
  }
  scene::Environment gradient;
  gradient.type = scene::EnvironmentType::Gradient;
  gradient.color = Vec3(1.0f, 0.5f, 0.2f);
  const auto plain = light(gradient);
  const trace::EnvironmentLevels none(plain);
  EXPECT_EQ(none.radiance({0.0f, 1.0f, 0.0f}, 1.0f), plain->radiance({0.0f, 1.0f, 0.0f}));
}

TEST(EnvironmentLevels, WeakenWavesAsAMeanOverTheSolidAngleDoes) {
  // Waves of a period of 8 of 256 texels along the horizon: rays as wide as a wave see their mean,
  // rays of a texel's width nearly the waves themselves.
  const auto sky = light(skyFile("waves", 256, 128, [](const Vec3& d) {
    return Vec3(0.5f + 0.5f * std::sin(32.0f * std::atan2(d.x, -d.z)));
  }));
  const trace::EnvironmentLevels levels(sky);
  const float texel = std::pow(2.0f * kPi / 256.0f, 2.0f);
  const auto swing = [&](float solidAngle) {
    float least = 2.0f;
    float most = 0.0f;
    for (int i = 0; i < 400; ++i) {
      const float phi = 0.01f * static_cast<float>(i);
      const float value = levels.radiance({std::sin(phi), 0.0f, -std::cos(phi)}, solidAngle).x;
      least = std::min(least, value);
      most = std::max(most, value);
    }
    return most - least;
  };
  EXPECT_GT(swing(texel), 1.8f);
  EXPECT_LT(swing(64.0f * texel), 0.1f);
  EXPECT_NEAR(levels.radiance({0.0f, 0.0f, -1.0f}, 64.0f * texel).x, 1.0f, 0.05f);
}

TEST(EnvironmentLevels, HaveNoSeamWhereTheImageEnds) {
  const trace::EnvironmentLevels levels(light(skyFile("round", 64, 32, [](const Vec3& d) {
    const float phi = std::atan2(d.x, -d.z);
    return Vec3(0.5f + 0.5f * std::sin(phi), 0.5f + 0.5f * std::cos(phi), 0.0f);
  })));
  constexpr int kSteps = 1000;
  Vec3 before(0.0f);
  for (int i = 0; i <= kSteps; ++i) {
    const float phi = 2.0f * kPi * static_cast<float>(i) / kSteps;
    const Vec3 value = levels.radiance({std::sin(phi), 0.0f, -std::cos(phi)}, 0.5f);
    if (i > 0) {
      EXPECT_LT(glm::length(value - before), 0.02f) << phi;
    }
    before = value;
  }
}

TEST(LobeSolidAngle, IsTheShareOfTheLobesDensity) {
  // Sums of the rays' solid angles times their density are 1; the middle ray of many is the axis'.
  for (const float g : {0.2f, 0.5f, 1.0f}) {
    const float n = scene::phongExponentFromRoughness(g);
    for (int k = 0; k < 16; ++k) {
      const Vec3 sample = trace::phongSample(g, {0.5f, 0.0f}, k, 16);
      const float density = (n + 1.0f) / (2.0f * kPi) * std::pow(sample.z, n);
      EXPECT_NEAR(trace::phongSolidAngle(g, {0.5f, 0.0f}, k, 16) * 16.0f * density, 1.0f, 2e-2f);
    }
  }
}

TEST(EnvironmentLevels, BringFewRaysNearerToMany) {
  test::SceneBuilder builder;
  builder.add(scene::makePlane({1.0f, 1.0f}, {1, 1}, scene::UvMode::Unit),
              builder.reflective(1.0f, 0.4f));
  scene::Scene scene = builder.scene();
  scene.environment = skyFile("suns", 256, 128, [](const Vec3& d) {
    return Vec3(std::sin(15.0f * d.x) * std::sin(12.0f * d.z) > 0.8f ? 10.0f : 0.1f);
  });
  const scene::Pose pose = scene::poseAt(scene, 0.0);
  const frame::Geometry geometry = frame::makeGeometry(scene, pose);
  const auto sky = light(scene.environment);
  const frame::Lighting lighting = frame::makeLighting(scene, pose, sky);
  const trace::TraceScene trace(scene, geometry, trace::BvhPolicy::Static);
  const trace::EnvironmentLevels levels(sky);
  std::vector<trace::ReflectionPoint> points;
  for (const Vec3& d : directions(400)) {
    if (!(d.y > 0.5f)) continue;
    trace::ReflectionPoint point{{0.0f, 0.0f, 0.0f}, {0.0f, 1.0f, 0.0f}, -d, 0.4f, 1.0f};
    points.push_back(point);
  }
  const auto seen = [&](int rays, const trace::EnvironmentLevels* environment) {
    std::vector<Vec3> radiance(points.size());
    trace::reflectedRadiance(trace, lighting, 0.0f, points,
                             {.rays = rays, .environment = environment}, false, radiance);
    return radiance;
  };
  const std::vector<Vec3> truth = seen(256, nullptr);
  const auto error = [&](const std::vector<Vec3>& radiance) {
    double sum = 0.0;
    for (std::size_t i = 0; i < truth.size(); ++i)
      sum += std::abs(static_cast<double>(radiance[i].x - truth[i].x));
    return sum / static_cast<double>(truth.size());
  };
  EXPECT_LT(error(seen(8, &levels)), 0.5 * error(seen(8, nullptr)));
}

}  // namespace
}  // namespace catoptric
