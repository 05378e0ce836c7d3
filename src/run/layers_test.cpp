#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "raster/gbuffer.h"
#include "run/layers.h"

namespace catoptric::run {
namespace {

TEST(Layers, MiddleSamplesAndMeans) {
  // One row of two pixels with 2 x 2 samples: a row of samples is p0 p0 p1 p1.
  image::Image image{2, 1, {"R"}, {10.0f, 20.0f}};
  SampleLayers layers;
  layers.depth = {0.5f, 0.5f, 0, 0, 0.5f, 0.25f, 0, 0};
  layers.object = {1, 1, 0, 0, 1, 7, 0, 0};
  layers.masks = {raster::kMaskClamped, 0, 0, 0, 0, 0, raster::kMaskClamped, raster::kMaskClamped};
  layers.diffuse.resize(8 * 4, 0.0f);
  layers.reflection.resize(8 * 4, 5.0f);  // what earlier frames left where nothing reflects
  for (const std::size_t sample : {0u, 1u, 4u, 6u}) layers.diffuse[sample * 4 + 3] = 0.4f;
  layers.wantDiffuse = false;
  layers.wantSpecular = true;
  addLayers(image, layers, 2, 0.01f);
  EXPECT_THAT(
      image.channels,
      testing::ElementsAre("R", "Z", "reflection.R", "reflection.G", "reflection.B", "s",
                           "id.object", "mask.reflective", "mask.environment", "mask.disoccluded",
                           "mask.clamped", "mask.retraced", "mask.below_horizon"));
  EXPECT_EQ(image.data.size(), 26u);
  EXPECT_EQ(image.at(0, 0, 0), 10.0f);
  EXPECT_EQ(image.at(1, 0, 0), 20.0f);
  EXPECT_FLOAT_EQ(image.at(0, 0, image.channel("Z")), 0.04f);
  EXPECT_EQ(image.at(1, 0, image.channel("Z")), 0.0f);  // nothing there
  EXPECT_FLOAT_EQ(image.at(0, 0, image.channel("s")), 0.3f);
  EXPECT_EQ(image.at(0, 0, image.channel("id.object")), 7.0f);
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
