#include "measure/errors.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <tuple>

#include "core/error.h"
#include "measure/ssim.h"
#include "measure/test_images.h"

namespace catoptric::measure {
namespace {

using image::Image;
using test::flat;
using test::linearOf;

TEST(CompareImages, StepsOf255ByHand) {
  // 4 pixels: differences (in steps) 0, 1, 2 in one, 30 in one channel of another
  Image a = flat(2, 2, linearOf(100));
  Image b = a;
  a.data[4] = linearOf(101);
  a.data[5] = linearOf(98);
  a.data[9] = linearOf(130);
  ImageError e = compareImages(a, b);
  EXPECT_EQ(e.pixels, 4u);
  EXPECT_EQ(e.sum8, 33u);
  EXPECT_DOUBLE_EQ(e.l1(), 33.0 / 12.0);
  EXPECT_EQ(e.max8, 30);
  EXPECT_EQ(e.max8X, 1);
  EXPECT_EQ(e.max8Y, 1);
  EXPECT_FALSE(e.hasReflective);

  // Over reflective pixels alone: the last one and one without a difference
  b.channels = {"R", "G", "B", "mask.reflective"};
  b.data.clear();
  for (const float mask : {0.0f, 0.0f, 0.25f, 1.0f})
    b.data.insert(b.data.end(), {linearOf(100), linearOf(100), linearOf(100), mask});
  e = compareImages(a, b);
  EXPECT_TRUE(e.hasReflective);
  EXPECT_EQ(e.reflective.pixels, 2u);
  EXPECT_DOUBLE_EQ(e.l1Reflective(), 30.0 / 6.0);
  EXPECT_DOUBLE_EQ(e.l1(), 33.0 / 12.0);
}

TEST(CompareImages, HalvesOfAStepAreRounded) {
  const Image a = flat(1, 1, 0.5f * (linearOf(100) + linearOf(101)));
  const int shown = static_cast<int>(std::lround(image::display8(a.data[0])));
  EXPECT_EQ(compareImages(a, flat(1, 1, linearOf(shown))).sum8, 0u);
  EXPECT_EQ(compareImages(flat(1, 1, 7.0f), flat(1, 1, 1.0f)).sum8, 0u);  // both are white
}

TEST(CompareImages, LinearMeasuresByHand) {
  Image a = flat(2, 1, 0.5f);
  const Image b = flat(2, 1, 0.25f);
  a.data = {0.5f, 0.25f, 0.25f, 0.25f, 0.25f, 0.0f};
  const ImageError e = compareImages(a, b);
  EXPECT_DOUBLE_EQ(e.mae(), 0.5 / 6.0);
  EXPECT_DOUBLE_EQ(e.rmse(), std::sqrt(0.125 / 6.0));
  EXPECT_DOUBLE_EQ(e.psnr(), 10.0 * std::log10(6.0 / 0.125));
  EXPECT_DOUBLE_EQ(e.maxLinear, 0.25);
  EXPECT_EQ(e.maxLinearX, 0);
}

TEST(CompareImages, EqualImages) {
  const Image a = flat(20, 13, 0.3f);
  const ImageError e = compareImages(a, a);
  EXPECT_EQ(e.l1(), 0.0);
  EXPECT_EQ(e.max8, 0);
  EXPECT_EQ(e.max8X, -1);
  EXPECT_TRUE(std::isinf(e.psnr()));
  EXPECT_NEAR(e.ssim(), 1.0, 1e-12);
}

TEST(CompareImages, NotFiniteCountsAsAllWrong) {
  Image a = flat(2, 2, 0.5f);
  Image b = a;
  a.data[3] = NAN;
  a.data[4] = INFINITY;
  b.data[9] = -INFINITY;
  const ImageError e = compareImages(a, b);
  EXPECT_EQ(e.notFinite, 1u);
  EXPECT_EQ(e.notFiniteReference, 1u);
  EXPECT_EQ(e.sum8, 2u * 3u * 255u);
  EXPECT_EQ(e.max8, 255);
  EXPECT_EQ(e.max8X, 1);
  EXPECT_EQ(e.max8Y, 0);
  EXPECT_EQ(e.linearValues, 6u);
  EXPECT_EQ(e.mae(), 0.0);
  EXPECT_TRUE(std::isfinite(e.ssim()));
  // Also against the reference's picture with one bounce
  Image truth = flat(2, 1, 0.5f);
  truth.channels.insert(truth.channels.end(), {"one_bounce.R", "one_bounce.G", "one_bounce.B"});
  truth.data.assign(12, 0.5f);
  truth.data[11] = NAN;
  Image nan = flat(2, 1, 0.5f);
  EXPECT_EQ(compareImages(nan, truth).l1OneBounce(), 0.5 * 255.0);
  nan.data[2] = NAN;
  EXPECT_EQ(compareImages(nan, truth).l1OneBounce(), 255.0);
  EXPECT_EQ(compareImages(nan, truth).l1Bounces(), 0.5 * 255.0);
  // All NaN on both sides is not equality
  const ImageError all = compareImages(flat(2, 2, NAN), flat(2, 2, NAN));
  EXPECT_EQ(all.l1(), 255.0);
}

TEST(CompareImages, OtherSizesAndMissingColoursAreUsageErrors) {
  EXPECT_THROW(compareImages(flat(2, 2, 0), flat(2, 3, 0)), UsageError);
  EXPECT_THROW(compareImages(Image{1, 1, {"Z"}, {0}}, flat(1, 1, 0)), UsageError);
}

TEST(CompareImages, LimitsAreOfAlphaTooAndRelativeAboveOne) {
  const Image a{2, 1, {"R", "G", "B", "A"}, {0.5f, 0.25f, 0.25f, 1.0f, 0.0f, 0.0f, 0.0f, 0.5f}};
  const Image b{2, 1, {"R", "G", "B", "A"}, {0.25f, 0.25f, 0.25f, 1.0f, 0.0f, 0.0f, 0.0f, 0.0f}};
  CompareOptions options;
  EXPECT_EQ(compareImages(a, b, "image", options).overPercent(), 50.0);
  EXPECT_EQ(compareImages(a, b, "image", options).meanLargest(), 0.125);
  options.forLimits = true;
  const ImageError e = compareImages(a, b, "image", options);
  EXPECT_EQ(e.overPercent(), 100.0);
  EXPECT_EQ(e.meanLargest(), 0.375);
  EXPECT_EQ(e.maxLinear, 0.5);
  EXPECT_EQ(e.maxLinearX, 1);
  EXPECT_EQ(e.mae(), 0.25 / 6.0);
  EXPECT_EQ(e.max8X, 0);
  EXPECT_EQ(compareImages(flat(1, 1, 10.0f), flat(1, 1, 8.0f), "image", options).maxLinear, 0.2);
}

TEST(CompareImages, RelativeErrorsAndThresholds) {
  Image a = flat(2, 2, 0.5f);
  const Image b = flat(2, 2, 0.25f);
  a.data = b.data;
  a.data[3] = 0.5f;
  a.data[6] = 0.25f + 1.0f / 64;
  CompareOptions options;
  options.threshold = 1.0 / 64;  // more than, not equal
  const ImageError e = compareImages(a, b, "image", options);
  EXPECT_EQ(e.over, 1u);
  EXPECT_DOUBLE_EQ(e.overPercent(), 25.0);
  EXPECT_NEAR(e.relMse(), (1.0 / 16 + 1.0 / 4096) / (1.0 / 16 + 0.01) / 12.0, 1e-15);
  EXPECT_EQ(e.maxLinearX, 1);
  EXPECT_EQ(e.maxLinearY, 0);
  EXPECT_GT(e.flip(), 0.0);
  EXPECT_GE(e.hdrFlipMax, e.hdrFlip());
}

/// Pixels of `image` with more channels, from R, G, B and these values per pixel.
Image withLayers(const Image& image, const std::vector<std::string>& names,
                 const std::vector<std::vector<float>>& layers) {
  Image result{image.width, image.height, image.channels, {}};
  result.channels.insert(result.channels.end(), names.begin(), names.end());
  for (std::size_t p = 0; p < image.pixelCount(); ++p) {
    for (std::size_t c = 0; c < 3; ++c) result.data.push_back(image.data[3 * p + c]);
    for (const auto& layer : layers) result.data.push_back(layer[p]);
  }
  return result;
}

TEST(CompareImages, PooledErrorsNameTheWorstFrameAndPixel) {
  const Image truth = flat(3, 2, linearOf(100));
  ImageError pooled;
  for (const auto& [frame, pixel, step] :
       {std::tuple(4, 1, 110), {7, 5, 130}, {8, 0, 130}, {9, 2, 120}}) {
    Image image = truth;
    image.data[3 * static_cast<std::size_t>(pixel)] = linearOf(step);
    addErrors(pooled, compareImages(image, truth), frame);
  }
  // The first of two that are equally wrong
  EXPECT_EQ(pooled.max8, 30);
  EXPECT_EQ(std::tuple(pooled.max8Frame, pooled.max8X, pooled.max8Y), std::tuple(7, 2, 1));
  EXPECT_EQ(std::tuple(pooled.maxLinearFrame, pooled.maxLinearX, pooled.maxLinearY),
            std::tuple(7, 2, 1));
  EXPECT_EQ(pooled.pixels, 24u);
  EXPECT_EQ(pooled.sum8, 90u);
  EXPECT_FLOAT_EQ(static_cast<float>(pooled.maxLinear), linearOf(130) - linearOf(100));
  Image worst = truth;
  worst.data[15] = linearOf(130);
  const ImageError one = compareImages(worst, truth);
  EXPECT_EQ(pooled.flipMax, one.flipMax);
  EXPECT_EQ(pooled.hdrFlipMax, one.hdrFlipMax);
  EXPECT_NE(pooled.flipMax, pooled.hdrFlipMax);
}

TEST(CompareImages, ObjectsAndClassesByHand) {
  // A row of 8 pixels; steps off: 1 2 4 8 16 32 64 128, in one channel each
  Image a = flat(8, 1, linearOf(100));
  const Image b = a;
  for (int p = 0; p < 8; ++p) a.data[static_cast<std::size_t>(3 * p)] = linearOf(100 + (1 << p));
  const Image run = withLayers(
      a, {"mask.environment", "mask.disoccluded", "mask.reflective", "id.object", "mask.glossy"},
      {{0, 0, 0.5f, 1, 0, 0, 0, 0},
       {0, 0, 0, 0.25f, 1, 0, 0, 0},
       {0, 1, 1, 1, 1, 1, 1, 1},
       {3, 3, 3, 3, 3, 3, 3, 7},
       {1, 0, 0, 0, 0, 1, 0, 0}});
  const ImageError e = compareImages(run, b);
  ASSERT_EQ(e.objects.size(), 2u);
  EXPECT_EQ(e.objects.at(3).sum8, 126u);  // without the first pixel, which does not reflect
  EXPECT_EQ(e.objects.at(7).sum8, 128u);
  EXPECT_EQ(e.reflective.sum8, 254u);
  const auto expect = [&](std::size_t i, const char* name, std::uint64_t all, std::uint64_t own,
                          std::uint64_t pixels) {
    EXPECT_EQ(e.classes.at(i).name, name);
    EXPECT_EQ(e.classes.at(i).all.sum8, all) << name;
    EXPECT_EQ(e.classes.at(i).own.sum8, own) << name;
    EXPECT_EQ(e.classes.at(i).own.pixels, pixels) << name;
  };
  ASSERT_EQ(e.classes.size(), 6u);
  expect(0, "mask.disoccluded", 8 + 16, 8 + 16, 2);
  expect(1, "mask.environment", 4 + 8, 4, 1);
  expect(2, "silhouette", 64 + 128, 64 + 128, 2);
  expect(3, "glossy", 32, 32, 1);  // what does not reflect is not glossy
  expect(4, "other reflective", 2, 2, 1);
  expect(5, "rest", 1, 1, 1);
}

TEST(CompareImages, EdgesDoNotMakeReflectors) {
  // A mirror (id 2) on a floor (id 1) before the background (0): edge pixels reflect in part
  const Image a = flat(5, 1, 0.25f);
  for (const char* layer : {"mask.reflective", "s"}) {
    const Image run =
        withLayers(a, {layer, "id.object"}, {{0.5f, 1, 1, 1, 0.25f}, {0, 2, 2, 2, 1}});
    const ImageError e = compareImages(run, flat(5, 1, 0.5f));
    EXPECT_EQ(e.reflective.pixels, 5u);
    ASSERT_EQ(e.objects.size(), 1u) << layer;
    EXPECT_EQ(e.objects.at(2).pixels, 3u);
  }
}

TEST(CompareImages, ForeignChannelNames) {
  Image plain = flat(3, 2, 0.25f);
  for (const auto& names : std::vector<std::vector<std::string>>{
           {"r", "g", "b"}, {"beauty.R", "beauty.G", "beauty.B"}}) {
    Image other = plain;
    other.channels = names;
    EXPECT_EQ(compareImages(other, plain).max8, 0);
  }
  Image grey{3, 2, {"Y"}, std::vector<float>(6, 0.25f)};
  EXPECT_EQ(compareImages(grey, plain).max8, 0);
  Image two = withLayers(plain, {"b.R", "b.G", "b.B"},
                         std::vector<std::vector<float>>(3, std::vector<float>(6, 0.0f)));
  EXPECT_EQ(compareImages(two, plain).max8, 0);  // R G B come first
  two.channels = {"a.R", "a.G", "a.B", "b.R", "b.G", "b.B"};
  EXPECT_THROW(compareImages(two, plain), UsageError);
}

TEST(FlipPool, QuantilesAreWeightedByError) {
  FlipPool pool;
  const std::vector<float> map{0.0f, 0.0f, 0.25f, 0.25f, 0.5f, 1.0f};
  pool.add(map);
  // Sums: 0.5 of 2 at 0.25, 1 at 0.5, the rest at 1
  EXPECT_EQ(pool.weightedQuantile(0.2), 0.25);
  EXPECT_EQ(pool.weightedQuantile(0.4), 0.5);
  EXPECT_EQ(pool.weightedQuantile(0.75), 1.0);
  EXPECT_EQ(pool.min(), 0.0);
  // Pools of parts, whichever is added to which
  FlipPool bright;
  bright.add(std::vector<float>{0.5f, 0.75f});
  for (const bool turned : {false, true}) {
    FlipPool both = turned ? bright : pool;
    both.add(turned ? pool : bright);
    EXPECT_EQ(both.min(), 0.0);
    EXPECT_EQ(both.weightedQuantile(0.9), 1.0);
    EXPECT_EQ(both.weightedQuantile(0.4), 0.5);
  }
  EXPECT_EQ(FlipPool().weightedQuantile(0.5), 0.0);
}

TEST(Ssim, ClosedForms) {
  // Constants: no variance, so only the term of the means is left
  const std::vector<float> a(300, 0.5f);
  const std::vector<float> b(300, 0.25f);
  EXPECT_NEAR(ssim(a, b, 20, 15), (2 * 0.125 + 1e-4) / (0.25 + 0.0625 + 1e-4), 1e-12);
  // A checkerboard and its negative: equal means of 0.5, variance 0.25, covariance -0.25 in every
  // window, but for what the window's cut leaves over
  std::vector<float> c;
  std::vector<float> d;
  for (int i = 0; i < 32 * 32; ++i) {
    c.push_back(static_cast<float>((i % 32 + i / 32) % 2));
    d.push_back(1.0f - c.back());
  }
  const double expected = (9e-4 - 0.5) / (9e-4 + 0.5);
  EXPECT_NEAR(ssim(c, d, 32, 32), expected, 0.02);
  EXPECT_NEAR(ssim(c, c, 32, 32), 1.0, 1e-12);
  // Symmetric
  const std::vector<float> grey(c.size(), 0.3f);
  EXPECT_DOUBLE_EQ(ssim(c, grey, 32, 32), ssim(grey, c, 32, 32));
}

}  // namespace
}  // namespace catoptric::measure
