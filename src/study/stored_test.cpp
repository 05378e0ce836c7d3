// What was measured is kept: errors in files, and values of cells as long as nothing of them
// changes.
#include "study/stored.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <set>

#include "study/frame_errors.h"

namespace catoptric::study {
namespace {

PointErrors twoFrames() {
  PointErrors errors;
  errors.frames[1] = {
      {{"L1_8bit", 1.0}, {"L1_8bit_reflective", 10.0}, {"max_8bit", 3.0}, {"rmse", 3.0}},
      100,
      0,
      {{7, {50, 20}}},
      {{"rays", 10}, {"refused", 1}},
      "a"};
  errors.frames[2] = {
      {{"L1_8bit", 3.0}, {"L1_8bit_reflective", 20.0}, {"max_8bit", 2.0}, {"rmse", 4.0}},
      300,
      0,
      {},
      {{"rays", 30}},
      "b",
      50};
  return errors;
}

TEST(PointErrors, ArePooledByHand) {
  PointErrors errors = twoFrames();
  errors.frames[3].metrics = {{"L1_8bit", 2.0}};  // nothing reflects there
  EXPECT_EQ(errors.pooled("L1_8bit", {1, 2}), 2.0);
  EXPECT_EQ(errors.pooled("max_8bit", {1, 2}), 3.0);
  EXPECT_EQ(errors.pooled("rmse", {1, 2}), std::sqrt(12.5));
  // By reflective pixels: 100 and 300 of them
  EXPECT_EQ(errors.pooled("L1_8bit_reflective", {1, 2}), 17.5);
  EXPECT_EQ(errors.pooled("L1_8bit_reflective", {1, 2, 3}), 17.5);
  EXPECT_TRUE(std::isnan(errors.pooled("L1_8bit_reflective", {3})));
  EXPECT_TRUE(std::isnan(errors.pooled("L1_8bit", {1, 9})));
  EXPECT_EQ(errors.worstFrame("L1_8bit", {1, 2, 3, 9}), 2);
  EXPECT_EQ(errors.worstFrame("max_8bit", {1, 2}), 1);
  EXPECT_EQ(errors.worstFrame("flip_mean", {1, 2}), 0);
  // Frame 1 has no frame before it; 50 and 150 pixels
  errors.frames[2].metrics["flicker"] = 4.0;
  errors.frames[3].metrics["flicker"] = 8.0;
  errors.frames[3].flickerPixels = 150;
  EXPECT_EQ(errors.pooled("flicker", {1, 2, 3}), 7.0);
  EXPECT_TRUE(std::isnan(errors.pooled("flicker", {1})));
  EXPECT_EQ(errors.meanCounter("rays", {1, 2}), 20.0);
  EXPECT_EQ(errors.meanCounter("refused", {1, 2}), 0.5);  // not counted: 0
}

TEST(PointErrors, ReadBackTheSame) {
  const auto file = std::filesystem::path(testing::TempDir()) / "study_errors/errors.json";
  std::filesystem::remove(file);
  EXPECT_TRUE(readErrors(file).frames.empty());
  const PointErrors written = twoFrames();
  writeErrors(file, written);
  const PointErrors read = readErrors(file);
  ASSERT_EQ(read.frames.size(), 2u);
  for (const auto& [number, frame] : written.frames) {
    const FrameErrors& other = read.frames.at(number);
    EXPECT_EQ(other.metrics, frame.metrics);
    EXPECT_EQ(other.reflectivePixels, frame.reflectivePixels);
    EXPECT_EQ(other.counters, frame.counters);
    EXPECT_EQ(other.pixels, frame.pixels);
    EXPECT_EQ(other.flickerPixels, frame.flickerPixels);
  }
  EXPECT_EQ(read.frames.at(1).objects.at(7).pixels, 50u);
  EXPECT_EQ(read.frames.at(1).objects.at(7).sum8, 20u);
}

TEST(StoredValues, AreStaleWhenAnythingOfTheirRunChanges) {
  const auto config = std::filesystem::path(testing::TempDir()) / "study_stored.json";
  const auto write = [&](const std::string& more, const std::string& traced,
                         const std::string& other) {
    std::ofstream(config) << R"({"comment": "not read", "scene": "a")" + more +
                                 R"(, "methods": [{"method": "traced", )" + traced +
                                 R"(}, {"method": "billboards")" + other + "}]}";
  };
  write("", R"("rays": 1)", "");
  Suite suite;
  SuiteRun run;
  run.name = "room";
  run.config = config;
  run.frames = {{"quick", "1-3"}};
  run.stated = "{}";
  suite.runs = {run};
  suite.efforts = {{"quick", {{"image.width", "64"}}}};
  std::string effort = "quick";
  const auto print = [&] { return StatedPrints(suite, effort).of("ms(room.traced)"); };
  const std::string first = print();
  EXPECT_FALSE(first.empty());
  EXPECT_EQ(print(), first);
  EXPECT_EQ(StatedPrints(suite, effort).of("ms(room.depth_impostors)"), "");
  EXPECT_EQ(StatedPrints(suite, effort).of("ms(hall.traced)"), "");
  // Of another method, and what is for people
  write(R"(, "$schema": "b")", R"("rays": 1)", R"(, "size": 8)");
  EXPECT_EQ(print(), first);

  std::set<std::string> prints = {first};
  const auto expectAnother = [&](const char* than) {
    EXPECT_TRUE(prints.insert(print()).second) << than;
  };
  write("", R"("rays": 2)", "");
  expectAnother("option");
  write(R"(, "threads": 2)", R"("rays": 2)", "");
  expectAnother("member of the config");
  suite.runs[0].stated = R"({"against": "reference"})";
  expectAnother("reference");
  suite.runs[0].frames["quick"] = "1-4";
  expectAnother("frames");
  suite.efforts["quick"] = {{"image.width", "65"}};
  expectAnother("setting of the effort");
  effort = "full";
  expectAnother("effort");
}

}  // namespace
}  // namespace catoptric::study
