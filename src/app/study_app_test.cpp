// The commands that measure, as programs.
#include <gmock/gmock.h>

#include "app/test_program.h"

namespace catoptric::app {
namespace {

using testing::HasSubstr;

/// Cells of a table's columns that are no times, line by line.
std::string exactCells(const std::string& csv) {
  std::istringstream lines(csv);
  std::string result;
  for (std::string line; std::getline(lines, line);) {
    std::vector<std::string> cells;
    std::istringstream text(line);
    for (std::string cell; std::getline(text, cell, ',');) cells.push_back(cell);
    for (const std::size_t column : {0, 1, 2, 4, 11, 12, 13})  // number, key, value, errors
      result += (column < cells.size() ? cells[column] : "") + " ";
    result += "\n";
  }
  return result;
}

constexpr const char* kSweep =
    "sweep run.json --method reference --set methods.reference.rays=1 --against truth --repeats 1 "
    "--progress none ";

class Sweep : public App {
 protected:
  Sweep() {
    std::ofstream(folder / "run.json") << R"({
  "scene": "scene.json", "path": "path.json", "frames": "1-3",
  "image": {"width": 32, "height": 24, "layers": ["s"]},
  "methods": [{"method": "reference", "samples": 1, "rays": 1},
              {"method": "reference", "name": "truth", "samples": 4, "rays": 1}],
  "errors": {"against": ["truth"]}
})";
  }
};

TEST_F(Sweep, WritesPointsCurvesAndAPage) {
  const Result result = run(std::string(kSweep) + "--vary methods.reference.samples=1,2,4 --out s");
  EXPECT_EQ(result.exitCode, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("too few rounds to tell"));
  for (const char* name : {"points.csv", "samples.csv", "sweep.json", "table.md", "table.tex",
                           "tradeoff.svg", "report.html"})
    EXPECT_GT(textOf(folder / "s" / name).size(), 100u) << name;
  // As many samples as the truth: the same pixels, no error.
  EXPECT_THAT(textOf(folder / "s/table.md"), HasSubstr("| 0 | 0 (1) |"));
  EXPECT_FALSE(fs::exists(folder / "s/logs"));
}

TEST_F(Sweep, ASettingWithoutEffectIsNamed) {
  // The only light is the environment: more bounces than the scene has mirrors change nothing.
  const Result result = run(std::string(kSweep) + "--vary methods.reference.bounces=8,9 --out s");
  EXPECT_EQ(result.exitCode, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("methods.reference.bounces has no effect on these frames"));
}

TEST_F(Sweep, ResumedItGivesTheSamePoints) {
  const std::string vary = "--vary methods.reference.samples=1,2,3 ";
  ASSERT_EQ(run(kSweep + vary + "--out whole").exitCode, 0);
  // Killed somewhere on its way, then resumed until it ends by itself
  for (const char* seconds : {"0.15", "0.4", "0.8"}) {
    const std::string command = "cd '" + folder.string() + "' && timeout -s KILL " + seconds + " " +
                                CATOPTRIC_PROGRAM + " " + kSweep + vary +
                                "--out part --existing resume >/dev/null 2>&1";
    (void)std::system(command.c_str());
  }
  const Result result = run(kSweep + vary + "--out part --existing resume");
  EXPECT_EQ(result.exitCode, 0) << result.err;
  EXPECT_EQ(exactCells(textOf(folder / "part/points.csv")),
            exactCells(textOf(folder / "whole/points.csv")));
  // Once more: nothing is rendered, nothing changes
  const std::string before = textOf(folder / "part/points.csv");
  ASSERT_EQ(run(kSweep + vary + "--out part --existing resume").exitCode, 0);
  EXPECT_EQ(textOf(folder / "part/points.csv"), before);
}

TEST_F(Sweep, WhatIsWrongEndsWithAHint) {
  const std::map<std::string, std::string> wrong{
      {"--vary methods.reference.sampels=1,2", "did you mean \"samples\"?"},
      {"--vary samples=1,2", "write --set methods.reference.samples"},
      {"--vary methods.reference.samples=4..1:3", "the range is empty"},
      {"--vary methods.reference.samples=0,1", "samples"},
      {"--vary methods.refrence.samples=1", "did you mean \"reference\"?"},
      {"--vary threads=1 --metric L1", "is no measure of errors"},
      {"--vary threads=1 --where 'a<2'", "no --vary is called \"a\""},
      {"--vary threads=1 --existing keep", "keep"},
      {"--vary threads=1 --clock sun", "must be one of"},
      {"--vary program=nowhere", "no such file"},
  };
  for (const auto& [options, hint] : wrong) {
    const Result result = run(kSweep + options + " --out s");
    EXPECT_EQ(result.exitCode, 2) << options << "\n" << result.err;
    EXPECT_THAT(result.err, HasSubstr(hint)) << options;
    EXPECT_FALSE(fs::exists(folder / "s")) << options;
  }
}

TEST_F(Sweep, AnUnknownReferenceIsNoMethod) {
  const Result result =
      run("sweep run.json --method reference --vary threads=1 --against trut --out s");
  EXPECT_EQ(result.exitCode, 2);
  EXPECT_THAT(result.err, HasSubstr("did you mean \"truth\"?"));
}

TEST_F(Sweep, AStrangeFolderStaysAsItIs) {
  fs::create_directories(folder / "s");
  std::ofstream(folder / "s/mine.txt") << "mine";
  for (const char* how : {"error", "overwrite", "resume"}) {
    const Result result = run(std::string(kSweep) + "--vary threads=1 --out s --existing " + how);
    EXPECT_EQ(result.exitCode, 5) << how;
  }
  EXPECT_EQ(textOf(folder / "s/mine.txt"), "mine");
}

}  // namespace
}  // namespace catoptric::app
