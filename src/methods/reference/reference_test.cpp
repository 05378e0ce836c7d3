#include "methods/reference/reference.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "core/parallel.h"
#include "frame/test_scenes.h"
#include "methods/testing/cpu_harness.h"

namespace catoptric::methods {
namespace {

using test::Moment;
using test::rotation;
using test::SceneBuilder;
using test::translation;

RunSettings frameOf(int width, int height) {
  RunSettings settings;
  settings.width = width;
  settings.height = height;
  return settings;
}

image::Image render(const scene::Scene& scene, const scene::Camera& camera,
                    const RunSettings& settings, const std::string& options,
                    Counters* counters = nullptr) {
  const Moment moment(scene);
  FrameOutput output = test::renderOnCpu(referenceEntry(), options, moment, camera, settings);
  if (counters != nullptr) *counters = output.counters;
  return std::move(output.image.value());
}

Vec3 rgb(const image::Image& image, int x, int y) {
  return {image.at(x, y, 0), image.at(x, y, 1), image.at(x, y, 2)};
}

TEST(Reference, RadianceThatIsNotFiniteIsCountedAndTakenAsNone) {
  // A plane that shines without bounds, seen itself and in a mirror across it
  SceneBuilder builder;
  const Mat4 up = rotation(90.0f, {1.0f, 0.0f, 0.0f});
  builder.add(scene::makePlane({2.0f, 2.0f}, {1, 1}, scene::UvMode::Unit),
              builder.diffuse(Vec3(0.5f), Vec3(std::numeric_limits<float>::infinity())),
              translation({-1.0f, 0.0f, -1.0f}) * up);
  builder.add(scene::makePlane({2.0f, 2.0f}, {1, 1}, scene::UvMode::Unit), builder.reflective(0.5f),
              translation({1.0f, 0.0f, -1.0f}) * rotation(-90.0f, {0.0f, 1.0f, 0.0f}) * up);
  Counters counters;
  const image::Image image =
      render(builder.scene(), scene::lookAt({0.0f, 0.0f, 3.0f}, {}, {0.0f, 1.0f, 0.0f}, 0.8f),
             frameOf(32, 32), R"({"max_standard_error": 0, "samples": 1})", &counters);
  EXPECT_GT(counters["not_finite"], 100u);
  EXPECT_EQ(counters["refused"], 0u);
  for (const float value : image.data) ASSERT_TRUE(std::isfinite(value));
}

TEST(Reference, WhiteFurnaceIsOneEverywhere) {
  // Albedo 1 in light of radiance 1 from everywhere: nothing can be seen, for any s and g.
  for (float s : {0.0f, 0.3f, 0.7f, 1.0f}) {
    for (float g : {0.0f, 0.3f, 0.6f, 1.0f}) {
      for (int bounces : {1, 3}) {
        SceneBuilder builder;
        builder.constantEnvironment(Vec3(1.0f));
        builder.add(scene::makeIcosphere(1.0f, 4, scene::UvMode::Unit),
                    builder.reflective(s, g, Vec3(1.0f)));
        Counters counters;
        const image::Image image =
            render(builder.scene(), scene::lookAt({0.0f, 0.5f, 3.0f}, {}, {0.0f, 1.0f, 0.0f}, 0.8f),
                   frameOf(32, 32),
                   R"({"max_standard_error": 0, "samples": 2, "bounces": )" +
                       std::to_string(bounces) + "}",
                   &counters);
        for (int y = 0; y < 32; ++y) {
          for (int x = 0; x < 32; ++x) {
            const Vec3 c = rgb(image, x, y);
            ASSERT_NEAR(c.x, 1.0f, 1e-4f) << s << " " << g << " at " << x << ", " << y;
            ASSERT_NEAR(c.z, 1.0f, 1e-4f);
          }
        }
        EXPECT_EQ(counters["refused"], 0u);
        if (s > 0.0f && g == 1.0f) {
          EXPECT_GT(counters["below_horizon"], 0u);
        }
      }
    }
  }
}

TEST(Reference, LitSphereHasLambertsRadiance) {
  // Directional light of irradiance E along the view: L = rho / pi E cos, cos from the picture.
  SceneBuilder builder;
  builder.add(scene::makeIcosphere(1.0f, 6, scene::UvMode::Unit), builder.diffuse(Vec3(0.6f)));
  scene::Light light;
  light.type = scene::LightType::Directional;
  light.direction = {0.0f, 0.0f, -1.0f};
  light.intensity = Vec3(2.0f);
  builder.scene().lights.push_back(light);
  const float distance = 4.0f;
  const scene::Camera camera = scene::lookAt({0.0f, 0.0f, distance}, {}, {0.0f, 1.0f, 0.0f}, 0.6f);
  const image::Image image = render(builder.scene(), camera, frameOf(65, 65),
                                    R"({"max_standard_error": 0, "samples": 1})");
  int seen = 0;
  for (int y = 0; y < 65; ++y) {
    for (int x = 0; x < 65; ++x) {
      const Vec3 d = scene::rayDirection(camera, 65, 65, static_cast<float>(x) + 0.5f,
                                         static_cast<float>(y) + 0.5f);
      const float b = distance * d.z;
      const float root = b * b - distance * distance + 1.0f;
      if (root < 0.01f) continue;  // silhouette and outside
      const Vec3 normal = Vec3(0.0f, 0.0f, distance) + (-b - std::sqrt(root)) * d;
      EXPECT_NEAR(rgb(image, x, y).y, 0.6f / kPi * 2.0f * normal.z, 2e-3f);
      EXPECT_EQ(image.at(x, y, 3), 1.0f);
      ++seen;
    }
  }
  EXPECT_GT(seen, 800);
}

TEST(Reference, PointLitPlaneHasItsClosedForm) {
  SceneBuilder builder;
  builder.add(scene::makePlane({10.0f, 10.0f}, {1, 1}, scene::UvMode::Unit),
              builder.diffuse(Vec3(0.5f, 0.25f, 1.0f)));
  scene::Light light;
  light.position = {0.5f, 1.5f, -0.25f};
  light.intensity = Vec3(3.0f);
  builder.scene().lights.push_back(light);
  const scene::Camera camera =
      scene::lookAt({0.0f, 2.0f, 3.0f}, {0.0f, 0.0f, 0.0f}, {0.0f, 1.0f, 0.0f}, 0.7f);
  const image::Image image = render(builder.scene(), camera, frameOf(40, 30),
                                    R"({"max_standard_error": 0, "samples": 1})");
  for (int y = 0; y < 30; ++y) {
    for (int x = 0; x < 40; ++x) {
      const Vec3 d = scene::rayDirection(camera, 40, 30, static_cast<float>(x) + 0.5f,
                                         static_cast<float>(y) + 0.5f);
      const Vec3 p = Vec3(0.0f, 2.0f, 3.0f) - (2.0f / d.y) * d;
      const Vec3 to = light.position - p;
      const float r = glm::length(to);
      const float e = 3.0f * (to.y / r) / (r * r);
      EXPECT_NEAR(rgb(image, x, y).x, 0.5f / kPi * e, 1e-5f);
      EXPECT_NEAR(rgb(image, x, y).z, 1.0f / kPi * e, 1e-5f);
    }
  }
}

/// Things of several colours in front of the plane z = 0.
void addThings(SceneBuilder& builder) {
  builder.add(scene::makeSphere(0.5f, 48, 24, scene::UvMode::Unit),
              builder.diffuse(Vec3(0.8f, 0.2f, 0.1f)), translation({-0.6f, 0.1f, 1.0f}));
  scene::BoxShape box;
  box.size = Vec3(0.6f, 0.8f, 0.5f);
  builder.add(scene::makeBox(box, scene::UvMode::Unit), builder.diffuse(Vec3(0.1f, 0.5f, 0.9f)),
              translation({0.7f, -0.2f, 1.3f}) * rotation(25.0f, {0.2f, 1.0f, 0.0f}));
  scene::Environment& environment = builder.scene().environment;
  environment.type = scene::EnvironmentType::Gradient;
  environment.color = Vec3(0.3f, 0.5f, 1.0f);
  environment.horizon = Vec3(1.0f);
  environment.ground = Vec3(0.2f, 0.15f, 0.1f);
}

TEST(Reference, PlaneMirrorShowsTheMirroredCamerasImage) {
  // A perfect mirror in z = 0 that fills the view, against a camera behind it without the mirror.
  SceneBuilder mirrored;
  addThings(mirrored);
  mirrored.add(scene::makePlane({100.0f, 100.0f}, {1, 1}, scene::UvMode::Unit),
               mirrored.reflective(1.0f), rotation(90.0f, {1.0f, 0.0f, 0.0f}));
  SceneBuilder plain;
  addThings(plain);

  // The camera looks at the mirror from above the things; behind the mirror the image is flipped.
  const Vec3 eye(0.2f, 1.8f, 3.0f);
  const Vec3 target(0.0f, -0.3f, 0.0f);
  const Vec3 flip(1.0f, 1.0f, -1.0f);
  const scene::Camera front = scene::lookAt(eye, target, {0.0f, 1.0f, 0.0f}, 0.5f);
  const scene::Camera behind = scene::lookAt(eye * flip, target * flip, {0.0f, 1.0f, 0.0f}, 0.5f);
  RunSettings settings = frameOf(64, 48);
  settings.layers = {"reflection", "s"};
  const image::Image inMirror =
      render(mirrored.scene(), front, settings, R"({"max_standard_error": 0, "samples": 1})");
  const image::Image direct =
      render(plain.scene(), behind, frameOf(64, 48), R"({"max_standard_error": 0, "samples": 1})");
  int compared = 0;
  int different = 0;
  for (int y = 0; y < 48; ++y) {
    for (int x = 0; x < 64; ++x) {
      if (inMirror.at(x, y, inMirror.channel("s")) != 1.0f) continue;  // a thing in front
      ++compared;
      const Vec3 a = rgb(inMirror, x, y);
      const Vec3 b = rgb(direct, 63 - x, y);
      different += glm::length(a - b) > 1e-3f ? 1 : 0;
    }
  }
  EXPECT_GT(compared, 1500);
  EXPECT_LE(different, compared / 500);  // silhouettes: rays that differ in their last bits
}

TEST(Reference, BouncesFormAGeometricSeriesBetweenMirrors) {
  // Two parallel mirrors of s = 1/2 facing each other, each emitting 1: along the normal
  // L_n = 1/2 + 1/2 L_(n-1), and the last surface shows its diffuse component, 1... so L = 1
  // always; with tint 1/2: L_n = 1/2 + 1/4 L_(n-1).
  SceneBuilder builder;
  const int material = builder.reflective(0.5f, 0.0f, Vec3(0.0f), Vec3(0.5f));
  builder.scene().materials[material].emissive = Vec3(1.0f);
  builder.add(scene::makePlane({100.0f, 100.0f}, {1, 1}, scene::UvMode::Unit), material);
  builder.add(scene::makePlane({100.0f, 100.0f}, {1, 1}, scene::UvMode::Unit), material,
              translation({0.0f, 2.0f, 0.0f}) * rotation(180.0f, {1.0f, 0.0f, 0.0f}));
  const scene::Camera camera =
      scene::lookAt({0.0f, 1.0f, 0.0f}, {0.0f, 0.0f, 0.0f}, {0.0f, 0.0f, 1.0f}, 0.2f);
  for (int bounces : {1, 2, 5}) {
    float expected = 1.0f;
    for (int i = 0; i < bounces; ++i) expected = 0.5f + 0.25f * expected;
    const image::Image image = render(
        builder.scene(), camera, frameOf(8, 8),
        R"({"max_standard_error": 0, "samples": 1, "bounces": )" + std::to_string(bounces) + "}");
    EXPECT_NEAR(rgb(image, 4, 4).x, expected, 1e-5f) << bounces;
  }
}

TEST(Reference, AllBouncesBetweenMirrorsAreTheWholeSeries) {
  // As above, L = 1/2 + 1/4 L: the limit is 2/3. Paths end when a reflection adds less than 0.1 %.
  SceneBuilder builder;
  const int material = builder.reflective(0.5f, 0.0f, Vec3(0.0f), Vec3(0.5f));
  builder.scene().materials[material].emissive = Vec3(1.0f);
  builder.add(scene::makePlane({100.0f, 100.0f}, {1, 1}, scene::UvMode::Unit), material);
  builder.add(scene::makePlane({100.0f, 100.0f}, {1, 1}, scene::UvMode::Unit), material,
              translation({0.0f, 2.0f, 0.0f}) * rotation(180.0f, {1.0f, 0.0f, 0.0f}));
  const scene::Camera camera =
      scene::lookAt({0.0f, 1.0f, 0.0f}, {0.0f, 0.0f, 0.0f}, {0.0f, 0.0f, 1.0f}, 0.2f);
  Counters counters;
  const image::Image image = render(builder.scene(), camera, frameOf(8, 8), "{}", &counters);
  EXPECT_NEAR(rgb(image, 4, 4).x, 2.0f / 3.0f, 1e-3f);
  EXPECT_EQ(counters["unfinished"], 0u);
  const int oneBounce = image.channel("one_bounce.R");
  ASSERT_GE(oneBounce, 0);
  EXPECT_NEAR(image.at(4, 4, oneBounce), 0.75f, 1e-5f);
  const int error = image.channel("standard_error.R");
  ASSERT_GE(error, 0);
  EXPECT_NEAR(image.at(4, 4, error), 0.0f, 1e-3f);

  // Perfect mirrors never end: the paths are cut, and counted.
  builder.scene().materials[material].specularLevel = 1.0f;
  builder.scene().materials[material].reflectionTint = Vec3(1.0f);
  render(builder.scene(), camera, frameOf(8, 8), "{}", &counters);
  EXPECT_GT(counters["unfinished"], 0u);
}

TEST(Reference, WhiteFurnaceHoldsForAnyBouncesAndAllOfThem) {
  // A box of white walls of any s and g, open to light of radiance 1: nothing can be seen in it.
  for (const float g : {0.0f, 0.5f}) {
    for (const int bounces : {0, 1, 7}) {
      SceneBuilder builder;
      builder.constantEnvironment(Vec3(1.0f));
      for (const float side : {-1.0f, 1.0f})
        builder.add(scene::makePlane({2.0f, 2.0f}, {1, 1}, scene::UvMode::Unit),
                    builder.reflective(0.8f, g, Vec3(1.0f)),
                    translation({0.0f, side, 0.0f}) *
                        rotation(side > 0.0f ? 180.0f : 0.0f, {1.0f, 0.0f, 0.0f}));
      const image::Image image =
          render(builder.scene(), scene::lookAt({0.0f, 0.3f, 2.0f}, {}, {0.0f, 1.0f, 0.0f}, 1.2f),
                 frameOf(16, 16), R"({"bounces": )" + std::to_string(bounces) + "}");
      for (int y = 0; y < 16; ++y)
        for (int x = 0; x < 16; ++x) ASSERT_NEAR(rgb(image, x, y).y, 1.0f, 1e-4f);
    }
  }
}

/// Two mirrors that face each other, about a checkered floor with things on it.
scene::Scene facingMirrors() {
  SceneBuilder builder;
  addThings(builder);
  const int mirror = builder.reflective(0.9f, 0.0f, Vec3(0.0f), Vec3(1.0f, 0.95f, 0.9f));
  for (const float side : {-1.0f, 1.0f})
    builder.add(scene::makePlane({6.0f, 6.0f}, {1, 1}, scene::UvMode::Unit), mirror,
                translation({0.0f, 0.0f, 1.0f + 2.0f * side}) *
                    rotation(-side * 90.0f, {1.0f, 0.0f, 0.0f}));
  return builder.scene();
}

scene::Scene glass() {
  SceneBuilder builder;
  addThings(builder);
  const int material = builder.reflective(0.9f, 0.0f, Vec3(0.0f));
  builder.scene().materials[material].refraction = 1.5f;
  builder.add(scene::makeSphere(0.7f, 48, 24, scene::UvMode::Unit), material,
              translation({0.0f, 0.0f, 2.0f}));
  return builder.scene();
}

scene::Scene lobes() {
  SceneBuilder builder;
  addThings(builder);
  const int ggx = builder.reflective(0.8f, 0.4f);
  builder.scene().materials[ggx].lobe = scene::LobeModel::Ggx;
  builder.add(scene::makePlane({6.0f, 6.0f}, {1, 1}, scene::UvMode::Unit), ggx,
              translation({0.0f, -0.7f, 0.0f}));
  builder.add(scene::makePlane({6.0f, 6.0f}, {1, 1}, scene::UvMode::Unit),
              builder.reflective(0.7f, 0.3f), rotation(90.0f, {1.0f, 0.0f, 0.0f}));
  return builder.scene();
}

/// A corner of mirrors and glossy walls with a mirror ball.
scene::Scene room() {
  SceneBuilder builder;
  addThings(builder);
  const auto wall = [&](float s, float g, const Vec3& color, const Mat4& place) {
    builder.add(scene::makePlane({6.0f, 6.0f}, {1, 1}, scene::UvMode::Unit),
                builder.reflective(s, g, color), place);
  };
  wall(0.3f, 0.2f, Vec3(0.6f, 0.4f, 0.2f), translation({0.0f, -0.7f, 0.0f}));
  wall(0.9f, 0.0f, Vec3(0.1f), rotation(90.0f, {1.0f, 0.0f, 0.0f}));
  wall(0.5f, 0.3f, Vec3(0.3f, 0.5f, 0.3f),
       translation({-1.5f, 0.0f, 0.0f}) * rotation(-90.0f, {0.0f, 0.0f, 1.0f}));
  builder.add(scene::makeSphere(0.4f, 48, 24, scene::UvMode::Unit), builder.reflective(1.0f),
              translation({0.1f, -0.3f, 2.0f}));
  return builder.scene();
}

/// A mirror whose normals come from a map of bumps, before things.
scene::Scene normalMapped() {
  SceneBuilder builder;
  addThings(builder);
  scene::Texture map;
  map.srgb = false;
  constexpr int kTexels = 64;
  map.levels = {{kTexels, kTexels, {}}};
  for (int y = 0; y < kTexels; ++y)
    for (int x = 0; x < kTexels; ++x)
      for (const double v :
           {0.5 + 0.1 * std::sin(0.4 * x), 0.5 + 0.1 * std::cos(0.7 * y), 1.0, 1.0})
        map.levels.front().rgba.push_back(static_cast<std::uint8_t>(255.0 * v));
  builder.scene().textures.push_back(map);
  const int mapped = builder.reflective(0.9f);
  builder.scene().materials[mapped].normalTexture.texture = 0;
  scene::Mesh wall = scene::makePlane({6.0f, 6.0f}, {1, 1}, scene::UvMode::Unit);
  wall.tangents.assign(wall.positions.size(), Vec4(1.0f, 0.0f, 0.0f, 1.0f));
  builder.add(std::move(wall), mapped, rotation(90.0f, {1.0f, 0.0f, 0.0f}));
  return builder.scene();
}

TEST(Reference, StandardErrorIsTheDistanceFromARunWith64TimesTheSamples) {
  const scene::Camera camera =
      scene::lookAt({0.4f, 0.6f, 2.9f}, {0.0f, -0.1f, 0.0f}, {0.0f, 1.0f, 0.0f}, 1.0f);
  const std::vector<std::pair<std::string, scene::Scene>> scenes = {
      {"facing mirrors", facingMirrors()},
      {"glass", glass()},
      {"lobes", lobes()},
      {"room", room()},
      {"normal map", normalMapped()}};
  for (const auto& [name, scene] : scenes) {
    const Moment moment(scene);
    RunSettings settings = frameOf(40, 30);
    const auto picture = [&](const std::string& options) {
      return test::renderOnCpu(referenceEntry(), options, moment, camera, settings);
    };
    const FrameOutput few = picture(R"({"max_standard_error": 255, "samples": 6, "rays": 1})");
    settings.seed = 2;
    const FrameOutput many = picture(R"({"max_standard_error": 255, "samples": 48, "rays": 1})");
    const methods::Row& row = few.tables.at(0).rows().at(0);
    ASSERT_EQ(std::get<std::int64_t>(row[0]), 36);
    const double stated = std::get<double>(row[1]);
    double sum = 0.0;
    for (int y = 0; y < settings.height; ++y)
      for (int x = 0; x < settings.width; ++x)
        for (int c = 0; c < 3; ++c)
          sum += std::abs(image::display8(few.image->at(x, y, c)) -
                          image::display8(many.image->at(x, y, c)));
    const double found = sum / (3.0 * settings.width * settings.height);
    EXPECT_GT(found, 0.1) << name;
    EXPECT_NEAR(stated / found, 1.0, 0.2) << name << ": stated " << stated << ", found " << found;
  }
}

TEST(Reference, TakesSamplesUntilItsStandardErrorIsSmallEnough) {
  const scene::Scene scene = room();
  const Moment moment(scene);
  const scene::Camera camera =
      scene::lookAt({0.4f, 0.6f, 2.9f}, {0.0f, -0.1f, 0.0f}, {0.0f, 1.0f, 0.0f}, 1.0f);
  RunSettings settings = frameOf(24, 18);
  std::int64_t before = 0;
  for (const double bound : {4.0, 1.0, 0.5}) {
    const FrameOutput output = test::renderOnCpu(
        referenceEntry(),
        R"({"samples": 1, "rays": 1, "max_standard_error": )" + std::to_string(bound) + "}", moment,
        camera, settings);
    const methods::Row& row = output.tables.at(0).rows().at(0);
    EXPECT_LE(std::get<double>(row[1]), bound);
    EXPECT_GT(std::get<std::int64_t>(row[0]), before);
    before = std::get<std::int64_t>(row[0]);
    // The layer has this mean
    double sum = 0.0;
    const int channel = output.image->channel("standard_error.R");
    for (int y = 0; y < settings.height; ++y)
      for (int x = 0; x < settings.width; ++x)
        for (int c = channel; c < channel + 3; ++c) sum += std::abs(output.image->at(x, y, c));
    EXPECT_NEAR(sum / (3.0 * settings.width * settings.height), std::get<double>(row[1]), 1e-5);
  }
}

TEST(Reference, TakesNoMoreSamplesThanTheLimit) {
  const scene::Scene scene = room();
  const Moment moment(scene);
  const scene::Camera camera =
      scene::lookAt({0.4f, 0.6f, 2.9f}, {0.0f, -0.1f, 0.0f}, {0.0f, 1.0f, 0.0f}, 1.0f);
  for (const char* samples : {"63", "64", "5"}) {
    const FrameOutput output = test::renderOnCpu(
        referenceEntry(),
        std::string(R"({"rays": 1, "max_standard_error": 1e-6, "samples": )") + samples + "}",
        moment, camera, frameOf(1, 1));
    EXPECT_EQ(std::get<std::int64_t>(output.tables.at(0).rows().at(0)[0]), 4096) << samples;
  }
}

TEST(Reference, GlossyLobeAveragesTheSkyByItsPower) {
  // A glossy floor seen straight down, under a step sky? A gradient sky is linear in y: the Phong
  // lobe about +y has mean cosine (n + 1) / (n + 2).
  for (float g : {0.3f, 0.5f, 0.8f, 1.0f}) {
    SceneBuilder builder;
    scene::Environment& environment = builder.scene().environment;
    environment.type = scene::EnvironmentType::Gradient;
    environment.color = Vec3(1.0f);
    environment.horizon = Vec3(0.0f);
    environment.ground = Vec3(100.0f);
    builder.add(scene::makePlane({10.0f, 10.0f}, {1, 1}, scene::UvMode::Unit),
                builder.reflective(1.0f, g));
    // Above the surface the camera itself casts nothing.
    const scene::Camera camera =
        scene::lookAt({0.0f, 3.0f, 0.0f}, {0.0f, 0.0f, 0.0f}, {0.0f, 0.0f, 1.0f}, 0.02f);
    const image::Image image = render(builder.scene(), camera, frameOf(9, 9),
                                      R"({"max_standard_error": 0, "samples": 4, "rays": 64})");
    const float n = scene::phongExponentFromRoughness(g);
    EXPECT_NEAR(rgb(image, 4, 4).x, (n + 1.0f) / (n + 2.0f), 3e-3f) << g;
  }
}

TEST(Reference, SameBitsForAnyThreadCountAndTwice) {
  SceneBuilder builder;
  addThings(builder);
  builder.add(scene::makePlane({100.0f, 100.0f}, {1, 1}, scene::UvMode::Unit),
              builder.reflective(0.7f, 0.4f), rotation(90.0f, {1.0f, 0.0f, 0.0f}));
  const scene::Camera camera = scene::lookAt({0.2f, 1.0f, 4.0f}, {}, {0.0f, 1.0f, 0.0f}, 0.6f);
  RunSettings settings = frameOf(67, 41);
  settings.masks = true;
  settings.layers = {"Z", "N", "reflection", "diffuse", "s", "id"};
  for (const std::string options : {R"({"max_standard_error": 0, "samples": 3, "bounces": 2})",
                                    R"({"max_standard_error": 0.5, "samples": 3})"}) {
    std::vector<image::Image> images;
    for (int threads : {1, 2, 2}) {
      setThreadCount(threads);
      images.push_back(render(builder.scene(), camera, settings, options));
    }
    setThreadCount(0);
    EXPECT_GE(images[0].channels.size(), 4u + 1u + 3u + 3u + 3u + 1u + 1u + 4u);
    for (const image::Image& image : images) {
      ASSERT_EQ(image.data.size(), images[0].data.size());
      EXPECT_EQ(
          std::memcmp(image.data.data(), images[0].data.data(), image.data.size() * sizeof(float)),
          0);
      for (float value : image.data) ASSERT_TRUE(std::isfinite(value));
    }
  }
}

TEST(Reference, LayersHoldWhatTheyName) {
  SceneBuilder builder;
  builder.constantEnvironment(Vec3(2.0f));
  builder.add(scene::makePlane({2.0f, 2.0f}, {1, 1}, scene::UvMode::Unit),
              builder.reflective(0.25f, 0.0f, Vec3(0.5f), Vec3(0.5f)));
  const scene::Camera camera =
      scene::lookAt({0.0f, 3.0f, 0.0f}, {0.0f, 0.0f, 0.0f}, {0.0f, 0.0f, 1.0f}, 1.2f);
  RunSettings settings = frameOf(33, 33);
  settings.layers = {"Z", "N", "reflection", "diffuse", "s", "id"};
  settings.masks = true;
  const image::Image image =
      render(builder.scene(), camera, settings, R"({"max_standard_error": 0, "samples": 2})");
  const auto value = [&](int x, const char* name) {
    const int c = image.channel(name);
    EXPECT_GE(c, 0) << name;
    return c >= 0 ? image.at(x, 16, c) : -1.0f;
  };
  EXPECT_NEAR(value(16, "Z"), 3.0f, 1e-5f);
  EXPECT_NEAR(value(16, "N.Y"), 1.0f, 1e-6f);
  EXPECT_NEAR(value(16, "reflection.R"), 2.0f, 1e-5f);
  EXPECT_NEAR(value(16, "diffuse.G"), 1.0f, 1e-5f);
  EXPECT_NEAR(value(16, "s"), 0.25f, 1e-6f);
  EXPECT_EQ(value(16, "id.object"), 1.0f);
  EXPECT_EQ(value(16, "mask.reflective"), 1.0f);
  EXPECT_EQ(value(16, "mask.environment"), 0.0f);
  EXPECT_EQ(value(16, "mask.sky"), 1.0f);
  EXPECT_NEAR(value(16, "R"), 0.75f * 1.0f + 0.25f * 0.5f * 2.0f, 1e-5f);
  EXPECT_EQ(value(0, "Z"), 0.0f);
  EXPECT_EQ(value(0, "id.object"), 0.0f);
  EXPECT_EQ(value(0, "A"), 0.0f);
  EXPECT_EQ(value(0, "mask.sky"), 0.0f);
  EXPECT_EQ(value(0, "R"), 2.0f);
}

/// A mirror over a checkered floor below a sky.
scene::Scene mirrorScene(scene::Mesh mesh) {
  SceneBuilder builder;
  scene::Environment& sky = builder.scene().environment;
  sky.type = scene::EnvironmentType::Gradient;
  sky.color = Vec3(0.2f, 0.4f, 1.0f);
  sky.horizon = Vec3(0.8f);
  sky.ground = Vec3(0.1f);
  builder.add(std::move(mesh), builder.reflective(1.0f));
  builder.add(scene::makePlane({6.0f, 6.0f}, {1, 1}, scene::UvMode::Unit),
              builder.diffuse(Vec3(0.6f, 0.3f, 0.2f)), translation({0.0f, -0.01f, 0.0f}));
  return builder.scene();
}

TEST(Reference, ImplicitSphereIsTheSphere) {
  // Seen in nothing but sky: every pixel is the closed form's, up to the outline.
  SceneBuilder builder;
  scene::Environment& sky = builder.scene().environment;
  sky.type = scene::EnvironmentType::Gradient;
  sky.color = Vec3(1.0f);
  sky.horizon = Vec3(0.5f);
  sky.ground = Vec3(0.0f);
  builder.add(scene::makeImplicit(implicit::sphereSurface(1.0), 8, scene::UvMode::Unit),
              builder.reflective(1.0f));
  const scene::Camera camera =
      scene::lookAt({0.0f, 1.5f, 3.0f}, {}, {0.0f, 1.0f, 0.0f}, radians(50.0f));
  constexpr int kSize = 96;
  const image::Image image = render(builder.scene(), camera, frameOf(kSize, kSize),
                                    R"({"max_standard_error": 0, "samples": 1})");
  int seen = 0;
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      const Vec3 ray = scene::rayDirection(camera, kSize, kSize, static_cast<float>(x) + 0.5f,
                                           static_cast<float>(y) + 0.5f);
      const glm::dvec3 o(camera.eye());
      const glm::dvec3 d = glm::normalize(glm::dvec3(ray));
      const double b = glm::dot(o, d);
      const double root = b * b - glm::dot(o, o) + 1.0;
      if (std::abs(root) < 1e-4) continue;
      double height = d.y;
      if (root > 0.0) {
        height = glm::reflect(d, o + (-b - std::sqrt(root)) * d).y;
        ++seen;
      }
      ASSERT_NEAR(image.at(x, y, 0), 0.5 + 0.5 * height, 5e-5) << x << ", " << y;
    }
  }
  EXPECT_GT(seen, 1500);
}

TEST(Reference, FineTrianglesConvergeToTheImplicitSurface) {
  const implicit::Surface vase = implicit::vaseSurface();
  const scene::ImplicitProfile profile{
      [](double s) { return glm::dvec2(((5.80 * s - 9.78) * s + 3.90) * s + 0.47, 2.0 * s); }};
  const scene::Camera camera =
      scene::lookAt({0.4f, 1.6f, 4.5f}, {0.0f, 0.9f, 0.0f}, {0.0f, 1.0f, 0.0f}, radians(35.0f));
  const auto picture = [&](int segments, bool exact) {
    scene::Mesh mesh =
        scene::makeTurnedImplicit(vase, profile, {segments, segments}, scene::UvMode::Unit);
    if (!exact) mesh.surface = nullptr;
    return render(mirrorScene(std::move(mesh)), camera, frameOf(96, 96),
                  R"({"max_standard_error": 0, "samples": 2, "bounces": 2})");
  };
  const image::Image truth = picture(8, true);
  const auto error = [&](const image::Image& image) {
    double sum = 0.0;
    for (int y = 0; y < image.height; ++y) {
      for (int x = 0; x < image.width; ++x) {
        for (int c = 0; c < 3; ++c) sum += std::abs(image.at(x, y, c) - truth.at(x, y, c));
      }
    }
    return sum / (3.0 * static_cast<double>(image.pixelCount()));
  };
  // The truth does not depend on its triangles; theirs falls to it.
  EXPECT_LT(error(picture(40, true)), 1e-6);
  const double coarse = error(picture(16, false));
  const double middle = error(picture(64, false));
  const double fine = error(picture(256, false));
  EXPECT_LT(middle, 0.35 * coarse);
  EXPECT_LT(fine, 0.35 * middle);
  EXPECT_LT(fine, 3e-4);
}

}  // namespace
}  // namespace catoptric::methods
