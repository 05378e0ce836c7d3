#include "report/errors.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "config/json.h"
#include "core/error.h"
#include "core/file.h"
#include "report/differences.h"

namespace catoptric::report {
namespace {

using image::Image;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// The linear value whose display value is `step`.
float linearOf(int step) {
  const double v = step / 255.0;
  return static_cast<float>(v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4));
}

Image flat(int width, int height, float value) {
  Image image{width, height, {"R", "G", "B"}, {}};
  image.data.assign(image.pixelCount() * 3, value);
  return image;
}

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
  // All NaN on both sides is not equality
  const ImageError all = compareImages(flat(2, 2, NAN), flat(2, 2, NAN));
  EXPECT_EQ(all.l1(), 255.0);
}

TEST(CompareImages, OtherSizesAndMissingColoursAreUsageErrors) {
  EXPECT_THROW(compareImages(flat(2, 2, 0), flat(2, 3, 0)), UsageError);
  EXPECT_THROW(compareImages(Image{1, 1, {"Z"}, {0}}, flat(1, 1, 0)), UsageError);
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

TEST(Difference, PlainAndTimesFifty) {
  Image a = flat(3, 1, linearOf(10));
  const Image b = a;
  a.data[0] = linearOf(13);
  a.data[4] = linearOf(4);
  a.data[8] = NAN;
  EXPECT_THAT(differenceRgb8(a, b, 1), ElementsAre(3, 0, 0, 0, 6, 0, 255, 0, 255));
  EXPECT_THAT(differenceRgb8(a, b, 50), ElementsAre(150, 0, 0, 0, 255, 0, 255, 0, 255));
}

class CompareRuns : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() /
              ("catoptric_errors_" + std::to_string(std::random_device{}()));
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  void writeFrame(const std::string& method, int number, const Image& image) {
    const auto frames = folder_ / method / "frames";
    std::filesystem::create_directories(frames);
    image::ExrOptions options;
    options.halfBeauty = false;
    writeFileAtomically(frames / ("frame.000" + std::to_string(number) + ".exr"),
                        image::encodeExr(image, options));
  }
  std::filesystem::path folder_;
};

TEST_F(CompareRuns, FramesArePooledByPixels) {
  Image off = flat(4, 4, linearOf(50));
  off.data[3 * 6 + 1] = linearOf(58);
  writeFrame("reference", 1, flat(4, 4, linearOf(50)));
  writeFrame("reference", 2, flat(4, 4, linearOf(50)));
  writeFrame("reference", 4, flat(4, 4, 0));
  writeFrame("traced", 1, flat(4, 4, linearOf(51)));
  writeFrame("traced", 2, off);
  writeFrame("traced", 3, off);
  const RunComparison c = compareRuns(readRun(folder_ / "traced"), readRun(folder_ / "reference"));
  ASSERT_EQ(c.frames.size(), 2u);
  EXPECT_DOUBLE_EQ(c.frames.at(1).l1(), 1.0);
  EXPECT_DOUBLE_EQ(c.frames.at(2).l1(), 8.0 / 48.0);
  EXPECT_DOUBLE_EQ(c.pooled.l1(), 56.0 / 96.0);
  EXPECT_EQ(c.pooled.max8, 8);
  EXPECT_EQ(c.pooled.max8Frame, 2);
  EXPECT_EQ(c.pooled.max8X, 2);
  EXPECT_EQ(c.pooled.max8Y, 1);
  EXPECT_THAT(c.onlyInRun, ElementsAre(3));
  EXPECT_THAT(c.onlyInReference, ElementsAre(4));
  const double squares =
      c.frames.at(1).rmse() * c.frames.at(1).rmse() + c.frames.at(2).rmse() * c.frames.at(2).rmse();
  EXPECT_NEAR(c.pooled.rmse(), std::sqrt(squares / 2.0), 1e-12);

  // Tables, CSV and JSON state the same
  const std::vector<RunComparison> one{c};
  const std::string text = toText(errorView(c));
  EXPECT_THAT(text, HasSubstr("traced against reference\n"));
  EXPECT_THAT(text, HasSubstr("\n    1    1.000 "));
  EXPECT_THAT(text, HasSubstr("\n  all    0.583 "));
  EXPECT_THAT(text, HasSubstr("reference lacks frames 3 of traced."));
  EXPECT_THAT(errorCsv(one), HasSubstr("\ntraced,reference,2,frame,0,0,16,0.16666666666666666,"));
  const config::Value json = config::parseText(errorJson(one), "errors");
  const config::Value first = json.asArray().at(0);
  EXPECT_EQ(first.get("pooled").get("max_8bit").asInteger(), 8);
  EXPECT_EQ(first.get("pooled").get("max_8bit_frame").asInteger(), 2);
  EXPECT_EQ(first.get("frames").asArray().at(0).get("l1_8bit").asNumber(), 1.0);
  EXPECT_EQ(first.get("only_in_run").dump(), "[3]");

  TimingTable fast{"traced", 1, {}, {}, {}, {}, {}};
  fast.rendering.mean = 0.05;
  TimingTable slow{"reference", 1, {}, {}, {}, {}, {}};
  slow.rendering.mean = 0.2;
  const std::vector<TimingTable> timings{fast, slow};
  const Table summary = errorSummary(one, timings);
  EXPECT_EQ(summary.rows[0][3], "0.583");
  EXPECT_EQ(summary.rows[0][14], "50.00");
  EXPECT_EQ(summary.rows[0][15], "0.250");

  compareRuns(readRun(folder_ / "traced"), readRun(folder_ / "reference"), {}, {folder_ / "d"});
  const auto png = image::decodeImage8(readFile(folder_ / "d/frame.0002.x50.png"), "d", 100);
  EXPECT_EQ(png.rgba[4 * 6 + 1], 255);
  EXPECT_EQ(png.rgba[4 * 6], 0);
  EXPECT_TRUE(std::filesystem::exists(folder_ / "d/frame.0001.png"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "d/frame.0003.png"));
}

TEST_F(CompareRuns, NothingInCommonIsAnError) {
  writeFrame("a", 1, flat(1, 1, 0));
  writeFrame("b", 2, flat(1, 1, 0));
  EXPECT_THROW(compareRuns(readRun(folder_ / "a"), readRun(folder_ / "b")), UsageError);
}

}  // namespace
}  // namespace catoptric::report
