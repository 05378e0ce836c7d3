// The table of a sweep, of results that are made up.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "study/sweep.h"

namespace catoptric::study {
namespace {

/// The table's columns between the method's and the time's.
std::vector<std::string> variedColumns(const SweepResult& result) {
  std::vector<std::string> titles;
  const report::Table table = sweepTable(result);
  for (std::size_t i = 2; table.columns[i].title != "steady frame ms"; ++i)
    titles.push_back(table.columns[i].title);
  return titles;
}

SweepPoint pointOf(const std::string& method, const Settings& settings) {
  SweepPoint point;
  point.setting.point.method = method;
  point.setting.point.settings = settings;
  point.seconds = 0.1;
  return point;
}

TEST(SweepTable, TheSameOptionOfSeveralMethodsHasOneColumn) {
  SweepResult result;
  result.points = {pointOf("a", {{"methods.a.rays", "8"}, {"methods.a.size", "64"}}),
                   pointOf("b", {{"methods.b.rays", "20"}})};
  EXPECT_EQ(variedColumns(result), (std::vector<std::string>{"rays", "size"}));
  const report::Table table = sweepTable(result);
  EXPECT_EQ(table.rows[0][2], "8");
  EXPECT_EQ(table.rows[0][3], "64");
  EXPECT_EQ(table.rows[1][2], "20");
  EXPECT_EQ(table.rows[1][3], "");
}

TEST(SweepTable, ErrorsAloneHaveNoColumnsOfTimes) {
  SweepResult result;
  result.points = {pointOf("a", {}), pointOf("b", {})};
  result.points[0].seconds = 0.0;
  EXPECT_EQ(sweepTable(result).columns[4].title, "ratio");
  result.points[1].seconds = 0.0;
  EXPECT_EQ(sweepTable(result).columns[2].title, "L1_8bit");
}

TEST(SweepTable, TimesOfOneStartAndOfAnotherClockAreLeftOut) {
  SweepResult result;
  result.points = {pointOf("a", {})};
  const auto titles = [&](Clock clock, TimeKind::Of of) {
    result.request.time = {clock, of, 9};
    std::string all;
    for (const report::Column& column : sweepTable(result).columns) all += column.title + "|";
    return all + (sweepTable(result).notes.back().find("First frame:") != std::string::npos
                      ? "first"
                      : "");
  };
  const std::string errors = "ratio|L1_8bit|worst (frame)||";
  EXPECT_EQ(titles(Clock::Wall, TimeKind::Of::Steady),
            "|method|steady frame ms|reflection alone ms|" + errors);
  EXPECT_EQ(titles(Clock::Cpu, TimeKind::Of::Steady), "|method|steady frame ms|" + errors);
  result.points[0].ratio.rounds = 8;
  EXPECT_EQ(titles(Clock::Cpu, TimeKind::Of::Mean),
            "|method|first frame ms|steady frame ms|mean of 9 frames ms|" + errors + "first");
}

TEST(SweepTable, SharesThatMethodsHandOnAreShown) {
  SweepResult result;
  result.points = {pointOf("a", {}), pointOf("b", {})};
  EXPECT_EQ(sweepTable(result).columns.size(), 8u);
  result.points[1].handedOn = 0.27;
  const report::Table table = sweepTable(result);
  ASSERT_EQ(table.columns.size(), 9u);
  EXPECT_EQ(table.columns[7].title, "handed on");
  EXPECT_EQ(table.rows[0][7], "");
  EXPECT_EQ(table.rows[1][7], "27.0 %");
  EXPECT_EQ(sweepPage(result, "").find("27.0 %") == std::string::npos, false);
}

TEST(SweepTable, OptionsThatAPointHasBothKeepTheirColumns) {
  SweepResult result;
  result.points = {pointOf("a", {{"image.width", "32"}, {"methods.a.width", "4"}})};
  EXPECT_EQ(variedColumns(result), (std::vector<std::string>{"width", "width"}));
}

}  // namespace
}  // namespace catoptric::study
