#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>

#include "image/exr_camera.h"
#include "raster/gbuffer.h"
#include "run/stage/layers.h"
#include "scene/camera.h"

namespace catoptric::run {
namespace {

TEST(Layers, GlossyIsWhatReflectsWithALobe) {
  // Three pixels of one sample: a mirror, a glossy one, a diffuse one with a meaningless g
  image::Image image{3, 1, {"R"}, {0, 0, 0}};
  SampleLayers layers;
  layers.masks = {0, 0, 0};
  layers.diffuse = {0, 0, 0, 1, 0, 0, 0, 0.5f, 0, 0, 0, 0};
  layers.normal = {0, 0, 1, 0, 0, 0, 1, 0.2f, 0, 0, 1, 0.2f};
  layers.wantDiffuse = layers.wantNormal = false;
  addLayers(image, layers, 1, 0.01f);
  EXPECT_LT(image.channel("N.X"), 0);
  const int glossy = image.channel("mask.glossy");
  ASSERT_GE(glossy, 0);
  EXPECT_EQ(image.at(0, 0, glossy), 0.0f);
  EXPECT_EQ(image.at(1, 0, glossy), 1.0f);
  EXPECT_EQ(image.at(2, 0, glossy), 0.0f);
}

TEST(ExrCamera, NdcIsWhereAPointIsSeen) {
  // For any point, the NDC of EXR is the image position whose ray meets the point.
  const scene::Camera camera =
      scene::lookAt(Vec3(1, 2, 3), Vec3(-0.5f, 0.3f, -2), Vec3(0, 1, 0), 0.8f);
  const std::vector<float> m = image::exrWorldToNdc(
      scene::cameraFromWorld(camera), camera.verticalFovRad, 640.0f / 480.0f, camera.nearMetres);
  for (const auto& [x, y] : {std::pair(0.0f, 0.0f), {640.0f, 480.0f}, {100.0f, 333.0f}}) {
    const Vec3 direction = scene::rayDirection(camera, 640, 480, x, y);
    const Vec3 point = camera.eye() + 3.7f * direction;
    std::array<float, 4> p{};
    for (std::size_t c = 0; c < 4; ++c)
      p[c] = point.x * m[c] + point.y * m[4 + c] + point.z * m[8 + c] + m[12 + c];
    EXPECT_NEAR(p[0] / p[3], x / 640.0f, 1e-5f);
    EXPECT_NEAR(p[1] / p[3], y / 480.0f, 1e-5f);
    const float depth = 3.7f * glm::dot(direction, camera.forward());
    EXPECT_NEAR(p[2] / p[3], 1.0f - camera.nearMetres / depth, 1e-5f);
  }
}

TEST(Layers, MiddleSamplesAndMeans) {
  // One row of two pixels with 2 x 2 samples: a row of samples is p0 p0 p1 p1.
  image::Image image{2, 1, {"R"}, {10.0f, 20.0f}};
  SampleLayers layers;
  layers.depth = {0.5f, 0.5f, 0, 0, 0.5f, 0.25f, 0, 0};
  layers.object = {1, 1, 0, 0, 1, 7, 0, 0};
  layers.ids = {{"cluster", {0, 0, 0, 0, 3, 3, 3, 9}}};
  layers.masks = {raster::kMaskClamped, 0, 0, 0, 0, 0, raster::kMaskClamped, raster::kMaskClamped};
  layers.filledMasks = raster::kMaskEnvironment | raster::kMaskClamped | raster::kMaskSky;
  layers.diffuse.resize(8 * 4, 0.0f);
  layers.reflection.resize(8 * 4, 5.0f);  // what earlier frames left where nothing reflects
  for (const std::size_t sample : {0u, 1u, 4u, 6u}) layers.diffuse[sample * 4 + 3] = 0.4f;
  layers.wantDiffuse = false;
  layers.wantSpecular = true;
  addLayers(image, layers, 2, 0.01f);
  EXPECT_THAT(image.channels,
              testing::ElementsAre("R", "Z", "reflection.R", "reflection.G", "reflection.B", "s",
                                   "id.object", "id.cluster", "mask.reflective", "mask.environment",
                                   "mask.clamped", "mask.sky"));
  EXPECT_EQ(image.data.size(), 24u);
  EXPECT_EQ(image.at(0, 0, 0), 10.0f);
  EXPECT_EQ(image.at(1, 0, 0), 20.0f);
  EXPECT_FLOAT_EQ(image.at(0, 0, image.channel("Z")), 0.04f);
  EXPECT_EQ(image.at(1, 0, image.channel("Z")), 0.0f);  // nothing there
  EXPECT_FLOAT_EQ(image.at(0, 0, image.channel("s")), 0.3f);
  EXPECT_EQ(image.at(0, 0, image.channel("id.object")), 7.0f);
  EXPECT_EQ(image.at(1, 0, image.channel("id.cluster")), 9.0f);
  EXPECT_EQ(image.at(0, 0, image.channel("mask.clamped")), 0.25f);
  EXPECT_EQ(image.at(1, 0, image.channel("mask.clamped")), 0.25f);  // sample 7 does not reflect
  EXPECT_EQ(image.at(0, 0, image.channel("mask.reflective")), 0.75f);
  EXPECT_EQ(image.at(1, 0, image.channel("mask.reflective")), 0.25f);
  EXPECT_EQ(image.at(0, 0, image.channel("reflection.G")), 3.75f);
  EXPECT_EQ(image.at(1, 0, image.channel("reflection.B")), 1.25f);
  EXPECT_EQ(image.at(1, 0, image.channel("mask.environment")), 0.0f);
}

}  // namespace
}  // namespace catoptric::run
