#include "report/timings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <random>

#include "config/json.h"
#include "core/error.h"

namespace catoptric::report {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

RunData fourFrames() {
  RunData run;
  run.name = "traced";
  run.stepKinds = {{"wait", "waiting"}, {"disocclusions", "check"}, {"layers", "extras"}};
  run.samples = {{0, "scene", 0.5, "wall", false}};
  const double bvh[] = {0.010, 0.020, 0.030, 0.100};
  for (int i = 0; i < 4; ++i) {
    run.samples.push_back({i + 1, "bvh", bvh[i], "wall", i == 0});
    run.samples.push_back({i + 1, "trace", 0.050, "wall", i == 0});
    run.samples.push_back({i + 1, "trace", 0.010, "wall", i == 0});  // twice in a frame
    run.samples.push_back({i + 1, "other", 0.001, "wall", i == 0});
    if (i == 2) run.samples.push_back({3, "wait", 0.5, "wall", false});
    run.samples.push_back({i + 1, "write", 0.3, "overlapped", false});
  }
  return run;
}

TEST(Timings, StatisticsByHand) {
  const TimingTable table = timingTable(fourFrames());
  EXPECT_EQ(table.frames, 4);
  const StepStatistics& bvh = *table.find("bvh");
  EXPECT_EQ(bvh.count, 4);
  EXPECT_DOUBLE_EQ(bvh.min, 0.010);
  EXPECT_DOUBLE_EQ(bvh.median, 0.025);
  EXPECT_DOUBLE_EQ(bvh.mean, 0.040);
  EXPECT_DOUBLE_EQ(bvh.max, 0.100);
  EXPECT_DOUBLE_EQ(bvh.first, 0.010);
  // Two samples of one step in a frame are one time of the frame
  EXPECT_EQ(table.find("trace")->count, 4);
  EXPECT_DOUBLE_EQ(table.find("trace")->max, 0.060);
  EXPECT_EQ(table.find("wait")->count, 1);
  EXPECT_LT(table.find("wait")->first, 0.0);
  // Rendering: without waiting and without what overlaps
  EXPECT_DOUBLE_EQ(table.rendering.mean, 0.040 + 0.060 + 0.001);
  EXPECT_DOUBLE_EQ(table.frame.max, 0.030 + 0.061 + 0.5);
  ASSERT_EQ(table.preparation.size(), 1u);
  EXPECT_EQ(table.preparation[0].step, "scene");
  ASSERT_EQ(table.overlapped.size(), 1u);
}

TEST(Timings, ChecksAreNoRendering) {
  RunData run = fourFrames();
  run.samples.push_back({2, "disocclusions", 9.0, "wall", false});
  const TimingTable table = timingTable(run);
  EXPECT_DOUBLE_EQ(table.rendering.mean, 0.040 + 0.060 + 0.001);
  EXPECT_DOUBLE_EQ(table.frame.max, 0.020 + 0.061 + 9.0);
  EXPECT_THAT(toText(timingView(table)), HasSubstr("disocclusions"));
}

TEST(Timings, CountersStandSideBySide) {
  std::vector<RunData> runs(2);
  runs[0].name = "traced";
  runs[0].counters = {{"rays", 12.0, 12.0}, {"refused", 0.0, 0.0}};
  runs[1].name = "second_order";
  runs[1].counters = {{"disoccluded", 3.25, 9.0}, {"refused", 0.0, 0.0}};
  EXPECT_EQ(toText(counterView(runs)),
            "Counted per frame: mean (most)\n"
            "counter      traced  second_order\n"
            "-----------  ------  ------------\n"
            "disoccluded               3.2 (9)\n"
            "rays             12\n"
            "0 in all frames: refused.\n");
}

TEST(Timings, ViewIsAlignedAndComplete) {
  const std::string text = toText(timingView(timingTable(fourFrames())));
  EXPECT_EQ(
      text,
      "traced: 4 frames, times in ms\n"
      "step             clock       frames     min  median    mean     max  first  share %  per s\n"
      "---------------  ----------  ------  ------  ------  ------  ------  -----  -------  -----\n"
      "bvh              wall             4   10.00   25.00   40.00  100.00  10.00     39.6\n"
      "trace            wall             4   60.00   60.00   60.00   60.00  60.00     59.4\n"
      "other            wall             4    1.00    1.00    1.00    1.00   1.00      1.0\n"
      "---------------  ----------  ------  ------  ------  ------  ------  -----  -------  -----\n"
      "rendering        wall             4   71.00   86.00  101.00  161.00  71.00    100.0  11.63\n"
      "wait             wall             1  500.00  500.00  500.00  500.00\n"
      "frame            wall             4   71.00  121.00  226.00  591.00  71.00            8.26\n"
      "---------------  ----------  ------  ------  ------  ------  ------  -----  -------  -----\n"
      "first frame      wall             1   71.00   71.00   71.00   71.00\n"
      "steady frame     wall             3   81.00   91.00  111.00  161.00\n"
      "mean of 1 frame  wall                                 71.00\n"
      "---------------  ----------  ------  ------  ------  ------  ------  -----  -------  -----\n"
      "write            overlapped       4  300.00  300.00  300.00  300.00\n"
      "---------------  ----------  ------  ------  ------  ------  ------  -----  -------  -----\n"
      "scene            wall             1  500.00  500.00  500.00  500.00\n"
      "First frame: with what the method builds before it (BVH, programs, levels). Steady frame: "
      "every other.\n"
      "Before the first frame: 500.00 ms in all (last rows).\n"
      "Min, median, mean and max include first frames (memory is allocated, caches are filled); "
      "per s is computed from the median.\n");
}

TEST(Timings, MethodsSideBySide) {
  RunData slow = fourFrames();
  slow.samples.push_back({0, "bvh", 0.2, "wall", false});
  slow.pathFrames = 10;
  RunData fast;
  fast.name = "environment_map";
  fast.samples = {{1, "environment", 0.004, "wall", true},
                  {1, "trace", 0.006, "wall", true},
                  {2, "environment", 0.004, "wall", false}};
  const std::vector<TimingTable> both{timingTable(fast, 10), timingTable(slow)};
  const Table table = timingComparison(both);
  EXPECT_EQ(table.columns.size(), 3u);  // no ratios
  EXPECT_THAT(table.rows[0], ElementsAre("environment", "4.00", ""));
  // 6 ms in one of two frames: the median of the frames that have the step
  EXPECT_THAT(table.rows[1], ElementsAre("trace", "6.00", "60.00"));
  EXPECT_THAT(table.notes.back(), HasSubstr("only some frames"));
  EXPECT_THAT(table.rows[2], ElementsAre("bvh", "", "25.00"));
  EXPECT_THAT(table.rows[3], ElementsAre("other", "", "1.00"));
  EXPECT_TRUE(table.rows[4].empty());
  EXPECT_THAT(table.rows[5], ElementsAre("rendering", "7.00", "86.00"));
  EXPECT_THAT(table.rows[6], ElementsAre("frames per s", "142.86", "11.63"));
  EXPECT_TRUE(table.rows[7].empty());
  // 71 ms and the BVH's 200, without the scene's 500; 81, 91 and 161 ms
  EXPECT_THAT(table.rows[8], ElementsAre("first frame", "10.00", "271.00"));
  EXPECT_THAT(table.rows[9], ElementsAre("steady frame", "4.00", "111.00"));
  EXPECT_THAT(table.rows[10], ElementsAre("mean of 10 frames", "4.60", "127.00"));
  EXPECT_THAT(toMarkdown(table), HasSubstr("| step | environment_map | traced |\n|---|---:|---:|"));
}

TEST(Timings, OneFrameHasNoRowsWithoutTimes) {
  RunData run;
  run.name = "traced";
  run.samples = {{0, "bvh", 0.2, "wall", false}, {1, "trace", 0.006, "wall", true}};
  run.pathFrames = 10;
  const std::vector<TimingTable> one{timingTable(run)};
  for (const std::string& text : {toText(timingView(one[0])), toText(timingComparison(one)),
                                  toTex(timingComparison(one)), toCsv(timingComparison(one)),
                                  toJson(timingComparison(one)), timingCsv(one), timingJson(one)}) {
    EXPECT_THAT(text, HasSubstr("first"));
    EXPECT_THAT(text, testing::Not(testing::AnyOf(HasSubstr("teady"), HasSubstr("mean of"))))
        << text;
  }
}

TEST(Timings, FramesApartAreSaidToBe) {
  RunData run = fourFrames();
  run.keeps = "images";
  EXPECT_EQ(timingTable(run).note, "");
  run.samples.push_back({6, "trace", 0.1, "wall", false});
  EXPECT_THAT(timingTable(run).note, HasSubstr("traced keeps images from frame to frame"));
  EXPECT_THAT(timingView(timingTable(run)).notes, testing::Contains(HasSubstr("not consecutive")));
  run.keeps.clear();
  EXPECT_EQ(timingTable(run).note, "");
}

/// A resumed run: each process has built its own.
TEST(Timings, BuildsAreThoseOfOneProcess) {
  RunData run = fourFrames();
  for (const char* step : {"scene", "bvh", "bvh"}) run.samples.push_back({0, step, 0.2, "wall", 0});
  EXPECT_DOUBLE_EQ(timingTable(run).first.mean, 0.071 + 0.2);
}

TEST(Timings, CsvKeepsEveryDigit) {
  const std::vector<TimingTable> one{timingTable(fourFrames())};
  const std::string text = timingCsv(one);
  EXPECT_THAT(text,
              testing::StartsWith("method,kind,step,clock,count,min,median,mean,max,sum,first\n"
                                  "traced,preparation,scene,wall,1,0.5,0.5,0.5,0.5,0.5,\n"
                                  "traced,step,bvh,wall,4,0.01,0.025,0.04,0.1,0.16,0.01\n"));
  EXPECT_THAT(text, HasSubstr("traced,overlapped,write,overlapped,4,0.3,"));
  EXPECT_THAT(text, HasSubstr("traced,total,frame,wall,4,"));
}

TEST(Timings, JsonHasWhatTheTableHas) {
  const std::vector<TimingTable> one{timingTable(fourFrames())};
  const config::Value json = config::parseText(timingJson(one), "json").asArray().at(0);
  EXPECT_EQ(json.get("name").asString(), "traced");
  EXPECT_EQ(json.get("frames").asInteger(), 4);
  EXPECT_EQ(json.get("rendering").get("median").asNumber(), one[0].rendering.median);
  EXPECT_EQ(json.get("steps").asArray().size(), one[0].steps.size());
  EXPECT_EQ(json.get("preparation").asArray().at(0).get("step").asString(), "scene");
}

TEST(Timings, EmptyRunsGiveTables) {
  RunData run;
  run.name = "none";
  const std::vector<TimingTable> one{timingTable(run)};
  EXPECT_THAT(toText(timingView(one[0])), HasSubstr("none: 0 frames"));
  EXPECT_NO_THROW(toText(timingComparison(one)));
}

TEST(ParseTimings, DamageIsNamedWithItsLine) {
  const std::string header = "frame,step,seconds,clock,first\n";
  const auto error = [&](const std::string& text) -> std::string {
    try {
      parseTimings(text, "timings.csv");
    } catch (const UsageError& e) {
      return e.what();
    }
    return "none";
  };
  EXPECT_EQ(parseTimings(header + "1,bvh,0.5,wall,1\r\n", "t").at(0).seconds, 0.5);
  EXPECT_THAT(error(""), HasSubstr("timings.csv: the file is empty"));
  EXPECT_THAT(error("step\n"), HasSubstr("timings.csv:1: \"step\": the header must be"));
  EXPECT_THAT(error(header + "1,bvh,0.5,wall\n"), HasSubstr(":2: "));
  EXPECT_THAT(error(header + "x,bvh,0.5,wall,0\n"), HasSubstr("not a frame number"));
  EXPECT_THAT(error(header + "1,bvh,nan,wall,0\n"), HasSubstr("not a time"));
  EXPECT_THAT(error(header + "1,bvh,-1,wall,0\n"), HasSubstr("not a time"));
  EXPECT_THAT(error(header + "1,bvh,1,wall,yes\n"), HasSubstr("0 or 1"));
}

TEST(ReadRun, FindsFramesAndSubfolders) {
  namespace fs = std::filesystem;
  const fs::path folder =
      fs::temp_directory_path() / ("catoptric_report_" + std::to_string(std::random_device{}()));
  for (const char* method : {"traced", "reference"})
    fs::create_directories(folder / method / "frames");
  for (const char* name :
       {"frame.0002.exr", "frame.12000.exr", "frame.x.exr", "frame.0003.tmp", "other.0001.exr"})
    std::ofstream(folder / "traced/frames" / name) << "x";
  fs::create_directories(folder / "traced/previews");
  for (const char* name : {"frame.0002.png", "frame.12000.png", "frame.0003.exr"})
    std::ofstream(folder / "traced/previews" / name) << "x";
  const RunData traced = readRun(folder / "traced/");
  EXPECT_EQ(traced.name, "traced");
  ASSERT_EQ(traced.frames.size(), 2u);
  EXPECT_EQ(traced.frames.begin()->first, 2);
  EXPECT_EQ(traced.frames.rbegin()->first, 12000);
  EXPECT_EQ(traced.previews.size(), 2u);
  EXPECT_THROW(readRun(folder), UsageError);
  EXPECT_THROW(readRun(folder / "absent"), UsageError);

  // Frames that the records do not have were made with other settings
  std::ofstream(folder / "traced/timings.csv")
      << "frame,step,seconds,clock,first\n0,scene,0.1,wall,0\n2,trace,0.2,wall,1\n";
  const RunData recorded = readRun(folder / "traced");
  ASSERT_EQ(recorded.frames.size(), 1u);
  EXPECT_EQ(recorded.frames.begin()->first, 2);
  ASSERT_EQ(recorded.previews.size(), 1u);
  EXPECT_EQ(recorded.previews.begin()->first, 2);
  fs::remove_all(folder);
}

TEST(Table, FormsForPapersAndProgramsKeepEveryLetter) {
  Table table;
  table.columns = {{"L1_8bit", true}, {"method", false}};
  table.rows = {{"0.5", "50 % & {a}$#~^\\"}, {}, {"", "b"}};
  EXPECT_EQ(toTex(table),
            "\\begin{tabular}{rl}\n\\toprule\nL1\\_8bit & method \\\\\n\\midrule\n"
            "0.5 & 50 \\% \\& \\{a\\}\\$\\#\\textasciitilde{}\\textasciicircum{}\\textbackslash{} "
            "\\\\\n\\midrule\n & b \\\\\n\\bottomrule\n\\end{tabular}\n");
  const config::Value json = config::parseText(toJson(table), "table");
  EXPECT_EQ(json.get("columns").dump(), R"(["L1_8bit","method"])");
  EXPECT_EQ(json.get("rows").dump(), R"([[0.5,"50 % & {a}$#~^\\"],["","b"]])");
}

TEST(Table, NarrowWindowsLoseTheLastDetailsAndSayWhich) {
  const Table table{.title = "t",
                    .columns = {{"name"}, {"first", true, true}, {"second", true, true}, {"last"}},
                    .rows = {{"a", "1", "2", "x"}, {}, {"b", "3", "4", "y"}},
                    .notes = {}};
  EXPECT_EQ(toText(table, 25), toText(table));
  EXPECT_EQ(toText(table, 24),
            "t\nname  first  last\n----  -----  ----\na         1  x\n----  -----  ----\n"
            "b         3  y\nLeft out to fit the window: second (all: | less -S)\n");
  EXPECT_EQ(toText(table, 1).substr(0, 13), "t\nname  last\n");
}

TEST(Table, BarsInCellsAreEscaped) {
  EXPECT_EQ(toMarkdown({"", {{"a|b"}}, {{"c"}}, {}}), "| a\\|b |\n|---|\n| c |\n");
}

}  // namespace
}  // namespace catoptric::report
