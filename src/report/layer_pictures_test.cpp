#include "report/layer_pictures.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <set>

#include "core/error.h"

namespace catoptric::report {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// Two pixels with the values of their channels.
image::Image frame(std::vector<std::string> channels, std::vector<float> data) {
  return {2, 1, std::move(channels), std::move(data)};
}

TEST(LayerPictures, LayersAreNamed) {
  const image::Image all = frame(
      {"A", "B", "G", "N.X", "N.Y", "N.Z", "R", "Z", "id.cluster", "id.object", "mask.retraced",
       "mask.sky", "other.X", "reflection.B", "reflection.G", "reflection.R", "s"},
      std::vector<float>(34));
  EXPECT_THAT(layerNames(all), ElementsAre("N", "Z", "id.cluster", "id.object", "mask.retraced",
                                           "mask.sky", "other.X", "reflection", "s"));
  EXPECT_THAT(layersNamed(all, "cluster", "f"), ElementsAre("id.cluster"));
  EXPECT_THAT(layersNamed(all, "id", "f"), ElementsAre("id.cluster", "id.object"));
  EXPECT_THAT(layersNamed(all, "mask.sky", "f"), ElementsAre("mask.sky"));
  EXPECT_THAT(layersNamed(all, "mask", "f"), ElementsAre("mask.retraced", "mask.sky"));
  try {
    layersNamed(all, "reflectoin", "frame.exr");
    FAIL() << "no error";
  } catch (const UsageError& error) {
    EXPECT_THAT(error.what(), HasSubstr("frame.exr: it has no layer \"reflectoin\" (did you mean "
                                        "\"reflection\"?); it has: N, Z,"));
  }
}

TEST(LayerPictures, NumbersHaveColoursThatDiffer) {
  EXPECT_EQ(colourOfId(0.0f), (Colour{0, 0, 0}));
  std::set<Colour> seen;
  for (int id = 1; id <= 500; ++id) {
    const Colour colour = colourOfId(static_cast<float>(id));
    seen.insert(colour);
    EXPECT_GT(*std::max_element(colour.begin(), colour.end()), 170) << id;
    // From the next number's by more than an eye needs
    const Colour next = colourOfId(static_cast<float>(id + 1));
    int apart = 0;
    for (std::size_t c = 0; c < 3; ++c) apart += std::abs(colour[c] - next[c]);
    EXPECT_GT(apart, 60) << id;
  }
  EXPECT_GT(seen.size(), 480u);
  const Rgb8 picture = layerPicture(frame({"id.object"}, {0.0f, 7.0f}), "id.object");
  const Colour seven = colourOfId(7.0f);
  EXPECT_THAT(picture.rgb, ElementsAre(0, 0, 0, seven[0], seven[1], seven[2]));
}

TEST(LayerPictures, ValuesAreGrays) {
  EXPECT_THAT(layerPicture(frame({"mask.sky"}, {1.0f, 0.25f}), "mask.sky").rgb,
              ElementsAre(255, 255, 255, 64, 64, 64));
  EXPECT_THAT(layerPicture(frame({"s"}, {std::nanf(""), -1.0f}), "s").rgb,
              ElementsAre(255, 0, 255, 0, 0, 0));
  EXPECT_THAT(layerPicture(frame({"Z"}, {3.0f, 6.0f}), "Z").rgb,
              ElementsAre(255, 255, 255, 128, 128, 128));
  EXPECT_THAT(layerPicture(frame({"Z"}, {0.0f, 6.0f}), "Z").rgb,
              ElementsAre(0, 0, 0, 255, 255, 255));
}

TEST(LayerPictures, VectorsAndColours) {
  EXPECT_THAT(layerPicture(frame({"N.X", "N.Y", "N.Z"}, {0, 1, -1, 0, 0, 0}), "N").rgb,
              ElementsAre(128, 255, 0, 0, 0, 0));
  const image::Image colours =
      frame({"diffuse.B", "diffuse.G", "diffuse.R"}, {0.0f, 0.18f, 1.0f, 0.5f, 0.5f, 0.5f});
  const Rgb8 picture = layerPicture(colours, "diffuse");
  EXPECT_NEAR(picture.rgb[0], image::display8(1.0f), 1.0f);
  EXPECT_NEAR(picture.rgb[1], image::display8(0.18f), 1.0f);
  EXPECT_NEAR(picture.rgb[2], 0, 1);
  EXPECT_NEAR(picture.rgb[3], image::display8(0.5f), 1.0f);
}

}  // namespace
}  // namespace catoptric::report
