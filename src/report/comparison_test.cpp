#include "report/comparison.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "config/json.h"
#include "core/error.h"
#include "core/file.h"
#include "measure/test_images.h"
#include "report/differences.h"
#include "report/error_tables.h"
#include "report/motion_tables.h"

namespace catoptric::report {
namespace {

using image::Image;
using test::flat;
using test::linearOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(ErrorTables, SharesOfClassesAddUpToTheFrame) {
  measure::ImageError e;
  e.pixels = 8;
  e.sum8 = 255;
  e.hasReflective = true;
  e.objects[7].pixels = 1;
  e.classes = {{"silhouette", {2, 192, 0.5, 0.25}, {2, 192, 0.5, 0.25}},
               {"rest", {6, 63, 0.5, 0.75}, {6, 63, 0.5, 0.75}}};
  RunComparison comparison;
  comparison.name = "run";
  comparison.reference = "truth";
  comparison.frames[1] = e;
  comparison.pooled = e;
  const Table table = attributionView(comparison);
  EXPECT_THAT(table.rows[0], testing::Contains("75.29"));  // 192 of 255
  EXPECT_THAT(table.rows[1], testing::Contains("24.71"));
  const std::vector<RunComparison> one{comparison};
  EXPECT_THAT(attributionCsv(one), HasSubstr("\nrun,truth,all,silhouette,2,32,25,"));
  EXPECT_THAT(errorCsv(one), HasSubstr("\nrun,truth,1,object:7,0,0,1,"));
  const config::Value json = config::parseText(errorJson(one), "errors").asArray().at(0);
  EXPECT_EQ(json.get("pooled").get("objects").asArray().at(0).get("id").asInteger(), 7);
  EXPECT_EQ(json.get("pooled").get("attribution").asArray().size(), 2u);
}

TEST(MotionTables, NameFlickerItsWorstPlaceAndGaps) {
  RunComparison c;
  c.name = "run";
  c.reference = "truth";
  measure::MotionMeter meter;
  const auto add = [&](int number, int step) {
    meter.add(number, measure::signedError(flat(32, 32, linearOf(step)), flat(32, 32, 0.0f)));
  };
  add(1, 10);
  c.motion = meter.result();
  EXPECT_TRUE(motionView(c).rows.empty());
  EXPECT_THAT(motionView(c).notes, ElementsAre(HasSubstr("no two frames are consecutive")));
  EXPECT_EQ(motionJson(c.motion), "null");
  add(2, 12);
  add(3, 20);
  add(9, 30);
  c.motion = meter.result();
  const Table table = motionView(c);
  EXPECT_THAT(table.title, HasSubstr("2 pairs"));
  EXPECT_THAT(table.rows.at(0), ElementsAre("all", "5.000", "", "", "", "", ""));
  EXPECT_THAT(table.notes[0], HasSubstr("frame 3 (8.000); there most around pixel 8,8 (8.000"));
  EXPECT_THAT(table.notes[1], HasSubstr("1 frames, first frame 9"));
  EXPECT_THAT(motionCsv(std::span(&c, 1)), HasSubstr("\nrun,truth,3,frame,1024,8,,,,,\n"));
  EXPECT_THAT(motionCsv(std::span(&c, 1)), HasSubstr("\nrun,truth,all,frame,2048,5,,,,,\n"));
  const config::Value json = config::parseText(motionJson(c.motion), "motion");
  EXPECT_EQ(json.get("frames").get("2").asNumber(), 2.0);
}

TEST(ErrorTables, TwoBlackFramesAreNamed) {
  RunComparison c;
  c.name = "run";
  c.reference = "truth";
  c.frames[1] = measure::compareImages(flat(4, 4, 0), flat(4, 4, 0));
  c.frames[2] = measure::compareImages(flat(4, 4, 0.5f), flat(4, 4, 0.5f));
  for (const auto& [number, e] : c.frames) measure::addErrors(c.pooled, e, number);
  EXPECT_TRUE(c.frames[1].isBlack());
  EXPECT_FALSE(c.pooled.isBlack());
  const Table table = errorView(c);
  EXPECT_THAT(table.rows[0], testing::Contains("black"));
  EXPECT_THAT(table.rows[1], testing::Contains("inf"));
  EXPECT_THAT(table.notes,
              testing::Contains(HasSubstr("both sides are completely black in frame 1;")));
  const std::vector<RunComparison> one{c};
  EXPECT_THAT(errorSummary(one, {}).notes, testing::Contains(HasSubstr("completely black")));
  EXPECT_THAT(errorJson(one), HasSubstr("\"both_black\":16"));
}

TEST(ErrorTables, TellTheTruthsOwnUncertaintyAndWhatBouncesAreWorth) {
  // The reference is 50 with all bounces and 40 with one, and says that it is off by 2. A method
  // with one bounce is 43: 7 off in all; 3 are its own, 10 those of the bounces.
  Image truth = flat(2, 1, linearOf(50));
  truth.channels = {"R",
                    "G",
                    "B",
                    "s",
                    "one_bounce.R",
                    "one_bounce.G",
                    "one_bounce.B",
                    "standard_error.R",
                    "standard_error.G",
                    "standard_error.B"};
  truth.data.clear();
  for (int pixel = 0; pixel < 2; ++pixel) {
    truth.data.insert(truth.data.end(), 3, linearOf(50));
    truth.data.push_back(pixel == 0 ? 1.0f : 0.0f);
    truth.data.insert(truth.data.end(), 3, linearOf(40));
    truth.data.insert(truth.data.end(), {2.0f, -2.0f, 2.0f});
  }
  const auto comparisonOf = [&](int reflective, int other) {
    Image image = flat(2, 1, linearOf(reflective));
    for (std::size_t c = 3; c < 6; ++c) image.data[c] = linearOf(other);
    RunComparison c;
    c.name = "traced";
    c.reference = "reference";
    c.pooled = measure::compareImages(image, truth);
    return c;
  };
  const RunComparison off = comparisonOf(43, 43);
  EXPECT_EQ(off.pooled.l1(), 7.0);
  EXPECT_EQ(off.pooled.standardError(), 2.0);
  EXPECT_EQ(off.pooled.l1OneBounce(), 3.0);
  EXPECT_EQ(off.pooled.l1Bounces(), 10.0);
  EXPECT_FALSE(off.pooled.withinUncertainty());
  const std::string text = toText(errorSummary(std::span(&off, 1)));
  EXPECT_THAT(text, HasSubstr("L1_8bit  standard_error  L1_8bit_reflective  L1_8bit_elsewhere  "
                              "L1_8bit_one_bounce  L1_8bit_bounces"));
  EXPECT_THAT(text, testing::Not(HasSubstr("within the uncertainty")));
  const config::Value json = config::parseText(errorJson(std::span(&off, 1)), "errors");
  EXPECT_EQ(json.asArray().at(0).get("pooled").get("L1_8bit_one_bounce").asNumber(), 3.0);

  // 1 off where it reflects, 2 elsewhere: within the uncertainty
  const RunComparison near = comparisonOf(51, 52);
  EXPECT_EQ(near.pooled.l1Reflective(), 1.0);
  EXPECT_EQ(near.pooled.elsewhere.l1(), 2.0);
  EXPECT_TRUE(near.pooled.withinUncertainty());
  EXPECT_THAT(errorView(near).notes,
              testing::Contains(HasSubstr("traced is within the uncertainty of reference: its "
                                          "L1_8bit 1.500 is not above the standard error 2.000")));
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
  EXPECT_EQ(first.get("frames").asArray().at(0).get("L1_8bit").asNumber(), 1.0);
  EXPECT_EQ(first.get("only_in_run").dump(), "[3]");

  TimingTable fast;
  fast.name = "traced";
  fast.rendering.median = 0.05;
  TimingTable slow;
  slow.name = "reference";
  slow.rendering.median = 0.2;
  const std::vector<TimingTable> timings{fast, slow};
  TimingTable cold;
  cold.frames = 1;
  EXPECT_EQ(errorSummary(one, std::span(&cold, 1)).columns.back().title, "first frame ms");
  const Table summary = errorSummary(one, timings);
  EXPECT_EQ(summary.rows[0][3], "0.583");
  EXPECT_EQ(summary.rows[0][13], "50.00");
  EXPECT_EQ(summary.columns.size(), 14u);  // no ratio of times that were not measured in turns
  // No column is empty; a note says why one is not there
  EXPECT_EQ(summary.rows[0][4], std::to_string(one[0].pooled.max8));
  EXPECT_THAT(toText(summary), HasSubstr("No L1_8bit_reflective of traced: no frame has"));
  std::vector<RunComparison> several(3, one[0]);
  several[2].name = "planar";
  EXPECT_THAT(errorSummary(several, {}).notes,
              testing::Contains(HasSubstr("No L1_8bit_reflective of traced, planar: no frame")));

  compareRuns(readRun(folder_ / "traced"), readRun(folder_ / "reference"), {}, {folder_ / "d"});
  const auto png = image::decodeImage8(readFile(folder_ / "d/frame.0002.x50.png"), "d", 100);
  EXPECT_EQ(png.rgba[4 * 6 + 1], 255);
  EXPECT_EQ(png.rgba[4 * 6], 0);
  for (const char* name : {"png", "x50.png", "flip.png", "hdrflip.png", "sheet.png"})
    EXPECT_TRUE(std::filesystem::exists(folder_ / "d" / ("frame.0001." + std::string(name))));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "d/frame.0003.png"));
}

TEST_F(CompareRuns, ForeignSequencesAndSingleFiles) {
  writeFrame("a", 1, flat(4, 4, 0));
  const auto frames = folder_ / "a/frames";
  const auto other = folder_ / "other";
  std::filesystem::create_directories(other);
  std::filesystem::copy(frames / "frame.0001.exr", other / "beauty_0012.exr");
  std::filesystem::copy(frames / "frame.0001.exr", other / "0013.exr");
  const RunData sequence = readSequence(other);
  EXPECT_EQ(sequence.name, "other");
  ASSERT_EQ(sequence.frames.size(), 2u);
  EXPECT_EQ(sequence.frames.begin()->first, 12);
  EXPECT_EQ(readSequence(folder_ / "a").frames.size(), 1u);
  EXPECT_EQ(readSequence(other / "0013.exr").frames.begin()->first, 13);
  std::filesystem::copy(frames / "frame.0001.exr", other / "b.12.exr");
  EXPECT_THROW(readSequence(other), UsageError);  // frame 12 twice
  try {
    readSequence(folder_ / "othre");
    FAIL() << "an absent folder is read";
  } catch (const UsageError& error) {
    EXPECT_THAT(error.what(), HasSubstr("othre: no such file or folder (did you mean \"other\"?)"));
  }
}

TEST_F(CompareRuns, NothingInCommonIsAnError) {
  writeFrame("a", 1, flat(1, 1, 0));
  writeFrame("b", 2, flat(1, 1, 0));
  EXPECT_THROW(compareRuns(readRun(folder_ / "a"), readRun(folder_ / "b")), UsageError);
}

}  // namespace
}  // namespace catoptric::report
