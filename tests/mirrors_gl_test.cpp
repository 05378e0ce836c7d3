// Methods held to what must be so: a plane mirror shows the mirrored camera's image, and in a white
// furnace mirrors are white.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "frame/test_environment.h"
#include "frame/test_scenes.h"
#include "methods/testing/gl_harness.h"

namespace catoptric {
namespace {

using test::rotation;
using test::SceneBuilder;
using test::translation;

constexpr int kWidth = 160;
constexpr int kHeight = 120;

const methods::RunSettings kSettings = test::framesOf(kWidth, kHeight, 1);

TEST(Mirrors, PlaneMirrorShowsTheMirroredCamerasImage) {
  SceneBuilder builder;
  builder.scene().environment.type = scene::EnvironmentType::Gradient;
  builder.scene().environment.color = Vec3(0.2f, 0.4f, 0.9f);
  builder.scene().environment.horizon = Vec3(0.8f);
  builder.scene().environment.ground = Vec3(0.3f, 0.2f, 0.1f);
  scene::Light light;
  light.position = {1.0f, 2.0f, 1.5f};
  light.intensity = Vec3(8.0f);
  builder.scene().lights.push_back(light);
  // The mirror stands in z = 0 and faces +z; all else is in front of it
  const int mirror = builder.add(scene::makePlane({4.0f, 3.0f}, {1, 1}, scene::UvMode::Unit),
                                 builder.reflective(0.9f), rotation(90.0f, {1.0f, 0.0f, 0.0f}));
  builder.add(scene::makeSphere(0.5f, 96, 48, scene::UvMode::Unit),
              builder.diffuse(Vec3(0.9f, 0.3f, 0.2f)), translation({-0.7f, -0.3f, 0.9f}));
  builder.add(scene::makeTorus(0.4f, 0.15f, 96, 48, scene::UvMode::Unit),
              builder.diffuse(Vec3(0.2f, 0.8f, 0.3f)),
              translation({0.8f, 0.2f, 1.1f}) * rotation(40.0f, {1.0f, 0.5f, 0.0f}));
  test::GlStage stage(builder.scene(), kSettings);
  const scene::Camera camera =
      scene::lookAt({0.6f, 0.5f, 4.0f}, {0.0f, 0.0f, 0.5f}, {0.0f, 1.0f, 0.0f}, 0.8f);
  // The same camera, mirrored over z = 0
  const Mat4 over = glm::scale(Mat4(1.0f), Vec3(1.0f, 1.0f, -1.0f));
  const Mat4 clip = scene::clipFromCamera(camera, static_cast<float>(kWidth) / kHeight) *
                    scene::cameraFromWorld(camera) * over;
  gl::Texture color = gl::Texture::make2D("mirrored", GL_RGBA32F, kWidth, kHeight);
  gl::Texture depth = gl::Texture::make2D("mirrored depth", GL_DEPTH_COMPONENT32F, kWidth, kHeight);
  const gl::Framebuffer target("mirrored", {{.texture = color}}, {.texture = depth});
  target.bind();
  target.clearDepth(0.0f);
  const Vec3 eye = camera.eye() * Vec3(1.0f, 1.0f, -1.0f);
  stage.raster.drawDiffuse(clip, eye, scene::pixelSpreadRad(camera, kHeight), stage.moment.lighting,
                           {.objects = raster::ObjectSet::without({mirror + 1})});
  stage.context.check("the mirrored image");
  const std::vector<float> mirrored = raster::readRgba(color);

  int claims = 0;
  for (const methods::MethodEntry& entry : methods::registry()) {
    if (entry.tests.planeMirrorPercent < 0.0) continue;
    ++claims;
    test::GlMethod(stage, entry, entry.tests.small).render(camera);
    const std::vector<std::uint32_t> ids = raster::readIds(stage.gbuffer.object);
    const std::vector<float> shown = raster::readRgba(stage.gbuffer.reflection);
    int compared = 0;
    int different = 0;
    int surfaces = 0;
    for (std::size_t i = 0; i < ids.size(); ++i) {
      if (static_cast<int>(ids[i]) != mirror + 1) continue;
      ++compared;
      surfaces += mirrored[4 * i + 3] > 0.0f ? 1 : 0;
      float worst = 0.0f;
      for (std::size_t c = 0; c < 3; ++c)
        worst = std::max(worst, std::abs(shown[4 * i + c] - mirrored[4 * i + c]));
      different += worst > 2e-3f ? 1 : 0;
    }
    std::printf("%s: %d of %d samples differ, %d show surfaces\n", entry.id.c_str(), different,
                compared, surfaces);
    EXPECT_GT(compared, 4000);
    EXPECT_GT(surfaces, 500);
    EXPECT_LE(different, compared * entry.tests.planeMirrorPercent / 100.0) << entry.id;
  }
  EXPECT_GE(claims, 1);
}

TEST(Mirrors, AreWhiteInAWhiteFurnace) {
  SceneBuilder builder;
  builder.constantEnvironment(Vec3(1.0f));
  builder.add(scene::makeSphere(0.6f, 64, 32, scene::UvMode::Unit),
              builder.reflective(1.0f, 0.0f, Vec3(1.0f)), translation({-0.7f, 0.0f, 0.0f}));
  builder.add(scene::makeSphere(0.6f, 64, 32, scene::UvMode::Unit),
              builder.reflective(0.5f, 0.0f, Vec3(1.0f)), translation({0.7f, 0.0f, 0.0f}));
  test::GlStage stage(builder.scene(), kSettings);
  const scene::Camera camera =
      scene::lookAt({0.0f, 0.2f, 4.0f}, Vec3(0.0f), {0.0f, 1.0f, 0.0f}, 0.8f);
  for (const methods::MethodEntry& entry : methods::registry()) {
    const auto method = entry.make(config::parseText(entry.tests.small, "options"));
    if (!method->plan(stage.scene, kSettings).gbuffer) continue;  // makes whole images
    if (!method->unsupported(stage.scene).empty()) continue;      // others fill its reflectors
    test::GlMethod(stage, entry, entry.tests.small).render(camera);
    const std::vector<std::uint32_t> ids = raster::readIds(stage.gbuffer.object);
    const std::vector<float> pixels = stage.composite(camera);
    int bad = 0;
    int reflecting = 0;
    float darkest = 1.0f;
    for (std::size_t i = 0; i < ids.size(); ++i) {
      reflecting += ids[i] != 0 ? 1 : 0;
      bool white = true;
      for (std::size_t c = 0; c < 3; ++c) {
        white = white && std::abs(pixels[4 * i + c] - 1.0f) <= 1e-3f;
        darkest = std::min(darkest, pixels[4 * i + c]);
      }
      bad += white ? 0 : 1;
    }
    EXPECT_GT(reflecting, 2000);
    EXPECT_LE(bad, static_cast<double>(ids.size()) * entry.tests.furnacePercent / 100.0)
        << entry.id << ", darkest " << darkest;
  }
}

/// A glossy plane under a sky of stripes that 8 rays cannot resolve, by a method.
std::vector<float> stripesOver(test::GlStage& stage, const std::string& method,
                               const std::string& options) {
  const scene::Camera camera =
      scene::lookAt({0.0f, 1.0f, 2.0f}, Vec3(0.0f), {0.0f, 1.0f, 0.0f}, 0.6f);
  test::GlMethod(stage, test::methodNamed(method), options).render(camera);
  return raster::readRgba(stage.gbuffer.reflection);
}

double meanDifference(const std::vector<float>& a, const std::vector<float>& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i)
    sum += std::abs(static_cast<double>(a[i]) - static_cast<double>(b[i]));
  return sum / static_cast<double>(a.size());
}

TEST(Mirrors, SeeAFilteredSkyByFewRaysAsByMany) {
  SceneBuilder builder;
  scene::Environment& sky = builder.scene().environment;
  sky.type = scene::EnvironmentType::File;
  sky.file = test::writeEnvironment("catoptric_stripes.exr", 512, 256, [](const Vec3& d) {
    return Vec3(std::sin(90.0f * std::atan2(d.x, -d.z)) > 0.0f ? 1.0f : 0.0f);
  });
  builder.add(scene::makePlane(Vec2(20.0f), {1, 1}, scene::UvMode::Unit),
              builder.reflective(1.0f, 0.45f));
  test::GlStage stage(builder.scene(), test::framesOf(64, 48, 1));
  const auto many = stripesOver(stage, "traced", R"({"rays": 256})");
  const auto plain = stripesOver(stage, "traced", R"({"rays": 8})");
  const auto filtered = stripesOver(stage, "traced", R"({"rays": 8, "environment": "filtered"})");
  const double plainError = meanDifference(plain, many);
  EXPECT_GT(plainError, 0.05);
  EXPECT_LT(meanDifference(filtered, many), 0.2 * plainError);
  // glossy_lod has the very same rays: where they leave the scene, the same bits; but that it
  // keeps the roots of solid angles
  for (const int rays : {1, 8, 256}) {
    const std::string count = R"({"rays": )" + std::to_string(rays);
    EXPECT_LT(
        meanDifference(stripesOver(stage, "glossy_lod", count + "}"),
                       stripesOver(stage, "traced", count + R"(, "environment": "filtered"})")),
        1e-6);
    EXPECT_EQ(stripesOver(stage, "glossy_lod", count + R"(, "filter": false})"),
              stripesOver(stage, "traced", count + "}"));
  }
}

}  // namespace
}  // namespace catoptric
