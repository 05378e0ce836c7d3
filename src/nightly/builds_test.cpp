#include "nightly/builds.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "nightly/test_lab.h"

namespace catoptric::nightly {
namespace {

namespace fs = std::filesystem;

class Builds : public testing::Test {
 protected:
  Builds()
      : folder(fs::path(testing::TempDir()) / ("builds_" + std::to_string(::getpid()))),
        one{"own.a.m", {}, "m", "1-8"} {
    fs::remove_all(folder);
    one.scene.name = "a";
  }
  ~Builds() override { fs::remove_all(folder); }

  BuildsComparison compare(const Build& now, const Build& before = {}) {
    builds = {{"now", now}, {"before", before}};
    return compareBuilds(one, lab, {folder / "now", folder / "before", folder / "differ", rounds});
  }
  static TimeState stateOfStep(const BuildsComparison& comparison, const std::string& step) {
    return std::ranges::find(comparison.steps, step, &StepRatio::step)->state;
  }

  int rounds = 8;
  fs::path folder;
  NightCase one;
  std::map<std::string, Build> builds;
  TestLab lab{builds};
};

TEST_F(Builds, EqualOnesHold) {
  const BuildsComparison comparison = compare({});
  EXPECT_EQ(comparison.frames, 8);
  EXPECT_EQ(comparison.equal, 8);
  EXPECT_TRUE(comparison.differences.empty());
  EXPECT_EQ(comparison.steps.size(), 5u);  // of the frame, and of the start
  EXPECT_EQ(comparison.steps[0].step, "frame");
  for (const StepRatio& step : comparison.steps) EXPECT_NE(step.state, TimeState::Fails);
  EXPECT_EQ(stateOfStep(comparison, "frame"), TimeState::Holds);
  EXPECT_FALSE(fs::exists(folder / "differ/own.a.m/baseline"));
}

TEST_F(Builds, PixelsAloneAreNotTimed) {
  Build lighter;
  lighter.steps["a"] = 1;
  rounds = 0;
  const BuildsComparison comparison = compare(lighter);
  EXPECT_EQ(comparison.frames, 8);
  EXPECT_EQ(comparison.equal, 0);
  EXPECT_TRUE(comparison.steps.empty());
}

TEST_F(Builds, ASlowerOneFails) {
  Build slow;
  slow.cost["a"] = 1.12;
  const BuildsComparison comparison = compare(slow);
  EXPECT_EQ(stateOfStep(comparison, "frame"), TimeState::Fails);
  EXPECT_EQ(stateOfStep(comparison, "reflect"), TimeState::Fails);
  EXPECT_EQ(stateOfStep(comparison, "start"), TimeState::Holds);
  EXPECT_EQ(comparison.equal, 8);
}

TEST_F(Builds, ASlowerStartFails) {
  Build slow;
  slow.startCost["a"] = 1.2;
  BuildsReport report;
  report.add(one.name, compare(slow));
  EXPECT_EQ(report.slower, 2);
  EXPECT_EQ(report.exitCode(), ExitCode::LimitsExceeded);
  EXPECT_THAT(report.sentence(0.05),
              testing::HasSubstr("2 steps are slower by more than 5 %, 0 undecided"));
  const std::vector<std::string>& row = report.table.rows.back();
  EXPECT_EQ(row[1], "start.bake");
  EXPECT_EQ(row[2], "slower");
  EXPECT_THAT(row[3], testing::MatchesRegex("1\\.[0-9]+ \\(1.[0-9]+ to 1.[0-9]+\\) times .* ms"));
}

TEST_F(Builds, OtherBitsAreNamed) {
  Build lighter;
  lighter.steps["a"] = 1;
  const BuildsComparison comparison = compare(lighter);
  EXPECT_EQ(comparison.frames, 8);
  EXPECT_EQ(comparison.equal, 0);
  ASSERT_EQ(comparison.differences.size(), 8u * 3u);
  EXPECT_THAT(comparison.differences[0], testing::StartsWith("frame 1 B: "));
  for (const char* side : {"now", "baseline"})
    EXPECT_TRUE(fs::exists(folder / "differ/own.a.m" / side / "frames/frame.0001.exr")) << side;
}

TEST_F(Builds, WhatFailsIsSaid) {
  Build crash;
  crash.crash.insert("a");
  EXPECT_EQ(compare(crash).failure, "killed by signal 11");
  EXPECT_EQ(compare({}, crash).noBaseline, "killed by signal 11");
}

}  // namespace
}  // namespace catoptric::nightly
