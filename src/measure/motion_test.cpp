#include "measure/motion.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <vector>

#include "measure/test_images.h"

namespace catoptric::measure {
namespace {

using image::Image;
using test::flat;
using test::linearOf;

/// An image of 32 x 32 pixels whose display steps a function of the pixel gives.
Image drawn(const std::function<int(int, int)>& step) {
  Image image = flat(32, 32, 0.0f);
  for (int y = 0; y < 32; ++y)
    for (int x = 0; x < 32; ++x)
      std::fill_n(image.data.begin() + (y * 32 + x) * 3, 3, linearOf(step(x, y)));
  return image;
}

/// Adds layers to an image: `values` gives those of a pixel, in the order of `names`.
Image withLayers(const Image& image, const std::vector<std::string>& names,
                 const std::function<std::vector<float>(int, int)>& values) {
  Image all{image.width, image.height, image.channels, {}};
  all.channels.insert(all.channels.end(), names.begin(), names.end());
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      for (int c = 0; c < 3; ++c) all.data.push_back(image.at(x, y, c));
      const std::vector<float> more = values(x, y);
      all.data.insert(all.data.end(), more.begin(), more.end());
    }
  return all;
}

TEST(Motion, AStillErrorDoesNotFlicker) {
  MotionMeter meter;
  const Image truth = drawn([](int x, int y) { return 100 + (x + y) % 7; });
  const Image frame = drawn([](int x, int y) { return 100 + (x + y) % 7 + (x % 2 == 0 ? 12 : 0); });
  for (int number = 1; number <= MotionError::kWindow; ++number)
    meter.add(number, signedError(frame, truth));
  const MotionError& motion = meter.result();
  EXPECT_EQ(motion.pairs, MotionError::kWindow - 1);
  EXPECT_EQ(motion.all.mean(), 0.0);
  EXPECT_EQ(motion.unsteady(), 0.0);
  // Half of the pixels err by 12: the root of the mean square is sqrt(72)
  EXPECT_NEAR(motion.steady(), std::sqrt(72.0), 1e-12);
}

TEST(Motion, AnErrorThatAlternatesByKStepsFlickersByK) {
  MotionMeter meter;
  const Image truth = flat(32, 32, linearOf(100));
  for (int number = 1; number <= 2 * MotionError::kWindow; ++number) {
    const std::vector<float> changes =
        meter.add(number, signedError(flat(32, 32, linearOf(number % 2 == 0 ? 104 : 96)), truth));
    if (number > 1) {
      EXPECT_THAT(changes, testing::Each(8.0f));
    }
  }
  EXPECT_DOUBLE_EQ(meter.result().all.mean(), 8.0);
  // E is 4 or -4: its mean is 0, its variance 16
  EXPECT_EQ(meter.result().steady(), 0.0);
  EXPECT_DOUBLE_EQ(meter.result().unsteady(), 4.0);
}

TEST(Motion, FramesThatChangeAsTheirTruthDoNotFlicker) {
  MotionMeter meter;
  for (int number = 1; number <= 12; ++number) {
    const Image frame = drawn([&](int x, int y) { return (31 * x + 17 * y + 53 * number) % 256; });
    meter.add(number, signedError(frame, frame));
  }
  EXPECT_EQ(meter.result().all.mean(), 0.0);
  EXPECT_EQ(meter.result().steady() + meter.result().unsteady(), 0.0);
}

TEST(Motion, AnErrorThatSticksToAMovingSurfaceIsSteadyAlongItsMotion) {
  MotionMeter meter;
  const Image truth = flat(32, 32, linearOf(100));
  for (int number = 1; number <= 4; ++number) {
    // The pattern moves by 3 pixels to the right and by 1 upwards in each frame
    const Image frame = drawn(
        [&](int x, int y) { return 100 + (x - 3 * number + 64) * 5 % 11 + (y + number) * 3 % 7; });
    meter.add(number,
              signedError(withLayers(frame, {"id.object", "Z", "motion.X", "motion.Y", "motion.Z"},
                                     [](int, int) {
                                       return std::vector<float>{1.0f, 2.0f, 3.0f, -1.0f, 2.0f};
                                     }),
                          truth));
  }
  const MotionError& motion = meter.result();
  EXPECT_TRUE(motion.hasMotion);
  EXPECT_GT(motion.all.mean(), 1.0);
  EXPECT_EQ(motion.alongMotion.mean(), 0.0);
  // What enters at the left or lower border has no place in the frame before
  EXPECT_EQ(motion.unmatched, 3u * (32 * 32 - 29 * 31));
}

TEST(Motion, SurfacesThatWereHiddenHaveNoPlaceInTheFrameBefore) {
  const Image truth = flat(32, 32, linearOf(100));
  const auto layers = [&](float last, float lastObject) {
    MotionMeter meter;
    meter.add(1, signedError(withLayers(truth, {"id.object", "Z"},
                                        [&](int, int) {
                                          return std::vector<float>{lastObject, last};
                                        }),
                             truth));
    meter.add(2,
              signedError(withLayers(truth, {"id.object", "Z", "motion.X", "motion.Y", "motion.Z"},
                                     [](int, int) {
                                       return std::vector<float>{1.0f, 2.0f, 0.0f, 0.0f, 2.0f};
                                     }),
                          truth));
    return meter.result().unmatchedPercent();
  };
  EXPECT_EQ(layers(2.0f, 1.0f), 0.0);
  EXPECT_EQ(layers(2.03f, 1.0f), 0.0);    // just below 2 % of the distance
  EXPECT_EQ(layers(2.05f, 1.0f), 100.0);  // just above
  EXPECT_EQ(layers(1.0f, 1.0f), 100.0);   // another part of the object stood in front
  EXPECT_EQ(layers(2.0f, 2.0f), 100.0);   // another object
}

TEST(Motion, OnlyReflectivePixelsCountAndReflectorsAreApart) {
  MotionMeter meter;
  const Image truth = flat(32, 32, linearOf(100));
  for (int number = 1; number <= 2; ++number) {
    // Left: no reflector; middle: object 3 changes by 6; right: object 5 changes by 2; far right:
    // an edge of object 7, which is no reflector itself
    const Image frame = drawn([&](int x, int) {
      return 100 + (number == 1 ? 0 : x < 8 ? 90 : x < 16 ? 6 : x < 31 ? 2 : 40);
    });
    meter.add(number,
              signedError(
                  withLayers(frame, {"mask.reflective", "id.object"},
                             [](int x, int) {
                               if (x == 31) return std::vector<float>{0.5f, 7.0f};
                               return std::vector<float>{x < 8 ? 0.0f : 1.0f, x < 16 ? 3.0f : 5.0f};
                             }),
                  truth));
  }
  const MotionError& motion = meter.result();
  EXPECT_TRUE(motion.hasReflective);
  EXPECT_DOUBLE_EQ(motion.all.mean(), (6.0 * 8 + 2.0 * 15 + 40.0) / 24);
  EXPECT_EQ(motion.objects.size(), 2u);
  EXPECT_DOUBLE_EQ(motion.objects.at(3).mean(), 6.0);
  EXPECT_DOUBLE_EQ(motion.objects.at(5).mean(), 2.0);
}

TEST(Motion, TheWorstFrameAndItsPlaceAreFound) {
  MotionMeter meter;
  const Image truth = flat(32, 32, linearOf(100));
  for (int number = 1; number <= 6; ++number) {
    // A spot pops up in frame 4, in the tile at the upper right; a fainter one in frame 2
    const Image frame = drawn([&](int x, int y) {
      if (number == 4 && x >= 20 && x < 24 && y >= 2 && y < 6) return 180;
      return number == 2 && x == 3 && y == 30 ? 110 : 100;
    });
    meter.add(number, signedError(frame, truth));
  }
  // Frame 5, in which the spot vanishes, flickers as much: the earlier frame is named
  EXPECT_EQ(meter.result().worstFrame, 4);
  EXPECT_EQ(meter.result().worstX, 24);
  EXPECT_EQ(meter.result().worstY, 8);
  EXPECT_DOUBLE_EQ(meter.result().worstTile, 80.0 * 16 / 256);
}

TEST(Motion, TheFloorIsTheFlickerOfNoise) {
  // The frame is exact; the truth has normal noise of 6 steps, and its layer noise of the same kind
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0.0, 6.0);
  MotionMeter meter;
  const auto own = [&](int, int) {
    return std::vector<float>(3, static_cast<float>(noise(random)));
  };
  for (int number = 1; number <= 20; ++number) {
    const Image truth =
        drawn([&](int, int) { return 128 + static_cast<int>(std::lround(noise(random))); });
    meter.add(
        number,
        signedError(
            flat(32, 32, linearOf(128)),
            withLayers(truth, {"standard_error.R", "standard_error.G", "standard_error.B"}, own)));
  }
  EXPECT_TRUE(meter.result().hasFloor);
  EXPECT_NEAR(meter.result().all.floor() / (12.0 / std::sqrt(std::numbers::pi)), 1.0, 0.02);
  EXPECT_NEAR(meter.result().all.mean() / meter.result().all.floor(), 1.0, 0.02);
}

TEST(Motion, TheWorstPlaceLiesInTheFrame) {
  // 20 x 18 pixels: the tiles at the right and lower border have 4 columns and 2 rows
  const auto picture = [](int number) {
    Image image = flat(20, 18, linearOf(100));
    for (const int x : {2, 17})  // a fainter spot at the border, where it fills more of its tile
      std::fill_n(image.data.begin() + (17 * 20 + x) * 3, 3,
                  linearOf(number == 1 ? 100
                           : x == 2    ? 130
                                       : 120));
    return image;
  };
  MotionMeter meter;
  for (const int number : {1, 2})
    meter.add(number, signedError(picture(number), flat(20, 18, linearOf(100))));
  EXPECT_EQ(meter.result().worstX, 18);
  EXPECT_EQ(meter.result().worstY, 17);
  EXPECT_DOUBLE_EQ(meter.result().worstTile, 20.0 / 8);
}

TEST(Motion, FramesBesideAGapMakeNoPair) {
  MotionMeter meter;
  const Image truth = flat(32, 32, linearOf(100));
  for (const int number : {1, 2, 90, 91, 200})
    meter.add(number, signedError(flat(32, 32, linearOf(100 + number % 50)), truth));
  EXPECT_EQ(meter.result().pairs, 2);
  EXPECT_THAT(meter.result().gaps, testing::ElementsAre(90, 200));
  EXPECT_DOUBLE_EQ(meter.result().all.mean(), 1.0);
  EXPECT_EQ(meter.result().windowPixels, 0u);
}

TEST(Motion, FramesOfAnotherSizeMakeNoPair) {
  MotionMeter meter;
  for (const int number : {1, 2, 3})
    meter.add(number, signedError(flat(16 * number, 32, 0.5f), flat(16 * number, 32, 0.5f)));
  EXPECT_EQ(meter.result().pairs, 0);
  EXPECT_THAT(meter.result().gaps, testing::ElementsAre(2, 3));
}

}  // namespace
}  // namespace catoptric::measure
