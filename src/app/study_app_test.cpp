// The commands that measure, as programs.
#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <csignal>

#include "app/test_program.h"
#include "config/json.h"

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
    for (const std::size_t column : {0, 1, 2, 4, 14, 15, 16})  // number, key, value, errors
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
  "methods": [{"method": "reference", "max_standard_error": 0, "samples": 1, "rays": 1},
              {"method": "reference", "max_standard_error": 0, "name": "truth", "samples": 4, "rays": 1}],
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

TEST_F(Sweep, FlickerRendersTheFrameBeforeToo) {
  const Result sweep =
      run(std::string(kSweep) +
          "--vary methods.reference.samples=1 --frames 3 --metric flicker --out s");
  EXPECT_EQ(sweep.exitCode, 0) << sweep.err;
  EXPECT_EQ(run("render run.json --frames 2-3 --out r -q").exitCode, 0);
  const Result compared = run("compare r/reference r/truth --json");
  const config::Value motion =
      config::parseText(compared.out, "compare").asArray().at(0).get("motion");
  const config::Value point =
      config::parseText(textOf(folder / "s/sweep.json"), "sweep").get("points").asArray().at(0);
  EXPECT_GT(motion.get("flicker").asNumber(), 0.0);
  EXPECT_DOUBLE_EQ(point.get("errors").get("flicker").get("all").asNumber(),
                   motion.get("flicker").asNumber());
  std::ofstream(folder / "f.suite.json") << R"json({"title": "F", "runs": {
  "r": {"config": "run.json", "against": "truth", "times": false, "frames": {"smoke": "3"}}},
  "tables": [{"title": "T", "columns": ["a", "b"],
              "rows": [["error(r.reference, flicker)", "error(r.reference, L1_8bit)"]]}]})json";
  const std::string command = "tables f.suite.json --effort smoke --out t --progress none ";
  const Result tables = run(command + "--format csv");
  EXPECT_EQ(tables.exitCode, 0) << tables.err;
  const std::string csv = textOf(folder / "t/tables.csv");  // three digits
  EXPECT_NEAR(std::stod(csv.substr(csv.find("a,b\n") + 4)), motion.get("flicker").asNumber(),
              0.01 * motion.get("flicker").asNumber());
  EXPECT_EQ(run(command + "--text-only").exitCode, 0);
}

TEST_F(Sweep, TheFloorOfFlickerIsThatOfTwoSeeds) {
  // A glossy floor around a ball looks alike from all sides, so errors of frames are correlated
  std::ofstream(folder / "scene.json") << R"({"objects": [
  {"shape": "plane", "size": [4, 4], "material": {"base_color": [0, 0, 0], "s": 0.9, "g": 0.4}},
  {"shape": "sphere", "radius": 0.5, "translate": [0, 0.7, 0],
   "material": {"base_color": [0.9, 0.2, 0.2]}}],
  "environment": {"type": "gradient", "zenith": [0.1, 0.1, 0.6], "horizon": [0.8, 0.8, 0.6],
                  "ground": [0.2, 0.2, 0.2]}})";
  std::ofstream(folder / "run.json") << R"({
  "scene": "scene.json", "path": "path.json", "frames": "1-4",
  "image": {"width": 48, "height": 36, "layers": ["s"]},
  "methods": [{"method": "reference", "samples": 2, "max_standard_error": 4, "rays": 1}]
})";
  for (const char* seed : {"1", "2"})
    EXPECT_EQ(run(std::string("render run.json -q --out r") + seed + " --seed " + seed).exitCode,
              0);
  const config::Value motion =
      config::parseText(run("compare r1 r2 --json").out, "compare").asArray().at(0).get("motion");
  EXPECT_GT(motion.get("flicker").asNumber(), 1.0);
  // The errors of both seeds change, independently
  EXPECT_NEAR(
      motion.get("flicker").asNumber() / (std::sqrt(2.0) * motion.get("flicker_floor").asNumber()),
      1.0, 0.15);
}

TEST_F(Sweep, TheConfigMaySayWhatIsSwept) {
  const std::string config = textOf(folder / "run.json");
  const auto write = [&](const std::string& sweep) {
    std::ofstream(folder / "run.json")
        << config.substr(0, config.rfind('}')) << ", \"sweep\": " << sweep << "}";
  };
  write(R"({"vary": ["methods.reference.samples=1,2"], "against": "truth", "repeats": 0,
            "metric": ["rmse"]})");
  const std::string command = "sweep run.json --method reference --progress none ";
  const Result result = run(command + "--out s");
  EXPECT_EQ(result.exitCode, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("rmse"));
  EXPECT_THAT(result.out, HasSubstr("2  reference        2"));
  // The command line is stronger; nothing else of the program changes.
  const Result other =
      run(command + "--vary methods.reference.samples=3 --metric L1_8bit --dry-run --repeats 1");
  EXPECT_THAT(other.out, HasSubstr("1 points, 6 frames"));
  EXPECT_EQ(run("plan run.json").exitCode, 0);
  write(R"({"vay": []})");
  EXPECT_THAT(run(command).err, HasSubstr("did you mean \"vary\"?"));
  write(R"({"vary": ["methods.reference.sampels=1"]})");
  EXPECT_EQ(run(command + "--out t").exitCode, 2);
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
      {"--time meen", "did you mean \"mean\""},
      {"--vary methods.reference.sampels=1,2", "did you mean \"samples\"?"},
      {"--vary samples=1,2", "write --set methods.reference.samples"},
      {"--vary methods.reference.samples=4..1:3", "must run from a smaller to a larger number"},
      {"--vary methods.reference.samples=0,1", "samples"},
      {"--vary methods.refrence.samples=1", "did you mean \"reference\"?"},
      {"--vary threads=1 --metric L1", "is not an error measure"},
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

TEST_F(Sweep, WorkersThatHangAreEnded) {
  std::ofstream(folder / "hangs") << "#!/bin/sh\nkill -STOP $$\n";
  fs::permissions(folder / "hangs", fs::perms::owner_all);
  const std::string arguments =
      "sweep run.json --method reference --vary program=./hangs --repeats 0 --frames 2 "
      "--against reference --progress none --out ";
  const auto start = std::chrono::steady_clock::now();
  const Result hung = run(arguments + "s --patience 0.02");
  EXPECT_THAT(hung.err, HasSubstr("did not answer for 1.2 s and was killed"));
  // A first signal ends all within 3 s.
  const std::string stopped = "cd '" + folder.string() +
                              "' && timeout --foreground --preserve-status -s TERM 1 "
                              "'" CATOPTRIC_PROGRAM "' " +
                              arguments + "t 2>stopped.txt";
  const int status = std::system(stopped.c_str());
  EXPECT_EQ(WEXITSTATUS(status), 128 + SIGTERM) << textOf(folder / "stopped.txt");
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(20));
}

TEST_F(Sweep, AFolderThatCannotBeMadeIsExit5) {
  const Result result =
      run("sweep run.json --method reference --vary threads=1,2 --repeats 0 --frames 2 --out "
          "run.json/s");
  EXPECT_EQ(result.exitCode, 5) << result.err;
  EXPECT_THAT(result.err, HasSubstr("run.json"));
}

TEST_F(Sweep, TheSameOptionsTwiceAreTwoSettings) {
  const Result result = run(
      R"(sweep run.json --set 'methods=[{"method": "reference", "max_standard_error": 0, "name": "a"}, )"
      R"({"method": "reference", "max_standard_error": 0, "name": "b"}]' --set errors.against=[] --against a )"
      "--method a,b --repeats 2 --progress none --out s");
  EXPECT_EQ(result.exitCode, 0) << result.err;
  const std::string samples = textOf(folder / "s/samples.csv");
  EXPECT_EQ(std::count(samples.begin(), samples.end(), '\n'),
            1 + 2 + 2 * 2 * 3);  // header, first frames, rounds
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

TEST_F(Sweep, OverwritingKeepsStrangeFiles) {
  const std::string command =
      std::string(kSweep) + "--vary threads=1,2 --frames 1 --out s --existing overwrite";
  ASSERT_EQ(run(command).exitCode, 0);
  const std::vector<std::string> foreign = {"s/mine.txt", "s/errors/notes.json", "s/frames/a.exr",
                                            "s/samples/1.csv.bak", "s/frames/mine/frame.0001.exr"};
  fs::create_directories(folder / "s/frames/mine");
  for (const std::string& name : foreign) std::ofstream(folder / name) << "mine";
  std::ofstream(folder / "s/samples/7.csv") << "of the earlier run";
  const Result again = run(command);
  EXPECT_EQ(again.exitCode, 0) << again.err;
  for (const std::string& name : foreign) EXPECT_EQ(textOf(folder / name), "mine") << name;
  EXPECT_FALSE(fs::exists(folder / "s/samples/7.csv"));
  // A link does not lead elsewhere
  fs::create_directories(folder / "elsewhere");
  std::ofstream(folder / "elsewhere/1.csv") << "mine";
  fs::rename(folder / "s/samples", folder / "old");
  fs::create_directory_symlink(folder / "elsewhere", folder / "s/samples");
  const Result refused = run(command);
  EXPECT_EQ(refused.exitCode, 5);
  EXPECT_THAT(refused.err, HasSubstr("s/samples: is a symbolic link"));
  EXPECT_EQ(textOf(folder / "elsewhere/1.csv"), "mine");
}

TEST_F(Sweep, TuneFindsTheFastestWithinAnError) {
  // Only 4 samples give the truth's pixels.
  const Result result =
      run("tune run.json --method reference --against truth --max-error 'L1_8bit<=0 every-frame' "
          "--vary methods.reference.samples=1,2,4 --repeats 1 --progress none --out t "
          "--test-path path.json");
  EXPECT_EQ(result.exitCode, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("reference samples=4"));
  EXPECT_THAT(result.out, HasSubstr("holds on all frames"));
  EXPECT_THAT(result.out, HasSubstr("On path.json: L1_8bit 0.000"));
  const Result tuned = run("render t/tuned.json --out tuned --frames 1 -q");
  EXPECT_EQ(tuned.exitCode, 0) << tuned.err;
  EXPECT_THAT(textOf(folder / "tuned/summary.json"), HasSubstr("\"samples\": 4"));
}

TEST_F(Sweep, TuneVariesWhatTradesAccuracyForTime) {
  const Result result =
      run("tune run.json --method environment_map --against truth --max-error 'L1_8bit<=255' "
          "--repeats 1 --progress none --out t");
  EXPECT_EQ(result.exitCode, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("environment_map face_size="));
  EXPECT_THAT(result.out, HasSubstr("of 3 combinations"));
  const Result none =
      run("tune run.json --method environment_map --against truth --max-error 'L1_8bit<=255' "
          "--vary none --repeats 1 --progress none --out u");
  EXPECT_THAT(none.out, HasSubstr("of 1 combinations"));
}

TEST_F(Sweep, TuneFindsTheMostAccurateWithinATime) {
  const Result result =
      run("tune run.json --method reference --against truth --max-time 10s --repeats 8 "
          "--vary methods.reference.samples=1,2,3 --frames 1 --progress none --out t");
  EXPECT_EQ(result.exitCode, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("reference samples=3"));
  const Result share =
      run("tune run.json --method reference --against truth --max-time 50x:truth --repeats 8 "
          "--vary methods.reference.samples=1,2,3 --frames 1 --progress none --out u");
  EXPECT_EQ(share.exitCode, 0) << share.err;
  EXPECT_THAT(share.out, HasSubstr("reference samples=3"));
}

TEST_F(Sweep, TuneNamesTheNearestWhereNothingSatisfies) {
  const Result result =
      run("tune run.json --method reference --against truth --max-error 'L1_8bit<=0' "
          "--vary methods.reference.samples=1,2,3 --repeats 1 --progress none --out t");
  EXPECT_EQ(result.exitCode, 7) << result.err;
  EXPECT_THAT(result.out, HasSubstr("Nearest: reference samples=3"));
  EXPECT_THAT(result.out, HasSubstr("Of this error, reflective pixels hold "));
  EXPECT_THAT(result.out, HasSubstr("The bound cannot be met: bound L1_8bit_reflective instead"));
  EXPECT_FALSE(fs::exists(folder / "t/tuned.json"));
}

TEST_F(Sweep, TuneKeepsItsBudgetAndNamesTheNearest) {
  // Hours, without a budget; one frame takes milliseconds
  const auto start = std::chrono::steady_clock::now();
  const Result result =
      run("tune run.json --method reference --against truth --max-error 'L1_8bit<=0' "
          "--set path=path.json --set frames=1-3 --vary methods.reference.samples=1..24:24 "
          "--vary methods.reference.rays=1..24:24 --repeats 1000 --budget 0.05 "
          "--progress none --out t");
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  EXPECT_EQ(result.exitCode, 7) << result.err;
  EXPECT_THAT(result.out, HasSubstr("The budget was spent"));
  EXPECT_THAT(result.out, HasSubstr("Nearest: reference samples="));
  EXPECT_GT(seconds.count(), 3.0);
  EXPECT_LT(seconds.count(), 3.0 * 2.0);  // of a machine that does other things, too
}

TEST_F(Sweep, TuneSaysBeforeWhatItWillDo) {
  const Result result =
      run("tune run.json --method reference --against truth --max-error 'L1_8bit<=1' "
          "--vary methods.reference.samples=1,2,3 --vary methods.reference.rays=1,2 --repeats 4 "
          "--dry-run --out t");
  EXPECT_EQ(result.exitCode, 0) << result.err;
  // The middle, two other numbers of samples, one of rays: one round of errors, one warm, four
  EXPECT_THAT(result.out, HasSubstr("6 combinations. First, 4 that differ in one option are "
                                    "measured on 3 of 3 frames: 72 frames to render"));
  EXPECT_FALSE(fs::exists(folder / "t"));
}

TEST_F(Sweep, TablesRenderWhatTheAskedOnesNeed) {
  std::ofstream(folder / "o.suite.json") << R"json({"title": "O", "runs": {
  "one": {"config": "run.json", "frames": {"smoke": "1"}, "against": "truth", "times": false},
  "two": {"config": "run.json", "frames": {"smoke": "2"}, "against": "truth", "times": false}},
  "tables": [
    {"title": "A", "columns": ["a"], "rows": [["error(one.reference, L1_8bit)"]]},
    {"title": "B", "columns": ["b", "c"], "rows": [["error(two.reference, L1_8bit)", "slope(1, s)"]]}],
  "figures": [{"title": "F", "x": "x", "y": "y", "values": [1, 2], "series": {
    "s": ["error(two.reference, L1_8bit)", "error(two.reference, rmse)"]}}],
  "checks": [{"value": "error(one.reference, L1_8bit)", "from": 0, "to": 255}]})json";
  const std::string command = "tables o.suite.json --effort smoke --out t --progress none ";
  const Result second = run(command + "--only 2");
  EXPECT_EQ(second.exitCode, 0) << second.err;
  EXPECT_THAT(second.err, HasSubstr("two: 2 frames rendered"));
  EXPECT_THAT(second.err, testing::Not(HasSubstr("one: ")));
  EXPECT_THAT(second.out, testing::Not(HasSubstr("A\n")));
  EXPECT_THAT(run(command).err, HasSubstr("one: 2 frames rendered"));
  EXPECT_THAT(run(command + "--only 3").err, HasSubstr("--only 3: the suite has 2 tables"));
  EXPECT_THAT(run(command + "--only 1 --check").err, HasSubstr("--only cannot be combined"));
}

TEST_F(Sweep, SaysHowFarTheReferenceItselfIsOff) {
  const Result result =
      run("sweep run.json --method reference --against truth --repeats 0 --progress none "
          "--set methods.truth.samples=1 --set methods.truth.max_standard_error=200 "
          "--vary methods.reference.samples=8,16 --out s");
  EXPECT_EQ(result.exitCode, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("The standard error of truth is "));
  const config::Value root = config::parseFile(folder / "s/sweep.json");
  for (const config::Value& point : root.get("points").asArray())
    EXPECT_GT(point.get("standard_error").asNumber(), 0.0);
}

TEST_F(Sweep, TuneRefusesWhatContradictsItself) {
  const std::map<std::string, std::string> wrong{
      {"", "give a bound"},
      {"--max-error 'L1_8bit<=1' --max-time 1s", "cannot be combined"},
      {"--max-error 'L1<=1'", "is not an error measure"},
      {"--max-error 'L1_8bit<=1' --vary image.width=8,16", "varies options of methods"},
      {"--max-error 'L1_8bit<=1' --verify most", "must be all, or a number"},
      {"--max-error 'L1_8bit<=1 every-frame' --per-reflector", "a bound on the mean error"},
      {"--max-time 0.8x:trut", "did you mean \"truth\"?"},
      {"--max-time 1s --repeats 2", "needs --repeats 8 or more"},
  };
  for (const auto& [options, hint] : wrong) {
    const Result result =
        run("tune run.json --method reference --against truth --out t " + options);
    EXPECT_EQ(result.exitCode, 2) << options << "\n" << result.err;
    EXPECT_THAT(result.err, HasSubstr(hint)) << options;
  }
  const Result first =
      run("tune run.json --method reference --against truth --max-error 'flicker<=1' --frames 1 "
          "--repeats 1 --vary none --progress none --out u");
  EXPECT_EQ(first.exitCode, 2) << first.out;
  EXPECT_THAT(first.err, HasSubstr("no frame has flicker: it needs a frame before it"));
}

TEST_F(Sweep, RepeatsOfARunSayHowFarRatiosHold) {
  const std::string command = "render run.json --out r --existing overwrite --frames 1-2 -q ";
  const Result result = run(command + "--repeats 8 --ratio-to truth");
  EXPECT_EQ(result.exitCode, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("interleaved rounds; x: time divided by that of truth"));
  EXPECT_THAT(result.out, HasSubstr(" to 0."));
  EXPECT_THAT(result.out, HasSubstr("mean of 6 frames"));
  EXPECT_THAT(result.out + result.err, testing::Not(HasSubstr("--repeats 8")));
  EXPECT_THAT(run(command + "--repeats 2").out, HasSubstr("too few rounds to tell"));
  EXPECT_EQ(run(command + "--ratio-to truth").exitCode, 2);
  EXPECT_THAT(run(command + "--repeats 2 --ratio-to trut").err, HasSubstr("did you mean"));
  EXPECT_EQ(run(command + "--repeats 2 --chunk 1/2").exitCode, 2);
}

TEST_F(Sweep, RatiosAreOfTracedElseOfReferenceElseOfTheFirst) {
  const std::vector<std::array<std::string, 3>> cases{
      {"reference", "traced", "traced"}, {"other", "reference", "reference"}, {"b", "a", "b"}};
  for (const auto& [first, second, base] : cases) {
    std::ofstream(folder / "two.json") << R"({
  "scene": "scene.json", "path": "path.json", "frames": "1", "image": {"width": 32, "height": 24},
  "methods": [{"method": "reference", "max_standard_error": 0, "name": ")"
                                       << first << R"(", "samples": 1, "rays": 1},
              {"method": "reference", "max_standard_error": 0, "name": ")"
                                       << second << R"(", "samples": 1, "rays": 1}]})";
    const Result result = run("render two.json --out r --existing overwrite -q --repeats 2");
    EXPECT_EQ(result.exitCode, 0) << result.err;
    EXPECT_THAT(result.out, HasSubstr("x: time divided by that of " + base + ","));
  }
}

TEST_F(Sweep, TextAloneLoadsNoSceneThatWasNeverMeasured) {
  std::ofstream(folder / "b.suite.json") << R"json({"title": "B", "runs": {
  "r": {"config": "run.json", "against": "truth"}},
  "tables": [{"title": "T", "columns": ["a"], "rows": [["ms(r.reference)"]]}]})json";
  fs::remove(folder / "scene.json");
  const Result result = run("tables b.suite.json --text-only --out t --progress none");
  EXPECT_EQ(result.exitCode, 2);
  EXPECT_THAT(result.err, HasSubstr("--text-only: the run r has not been measured"));
}

TEST_F(Sweep, ASlopeOfItselfIsRefused) {
  for (const auto& [cells, text] :
       {std::pair(R"-(["slope(1, a)"])-", "has a slope among its values"),
        std::pair("[1, 2]", "has 2 values, its figure 1")}) {
    std::ofstream(folder / "b.suite.json")
        << R"json({"title": "B", "runs": {"r": {"config": "run.json", "against": "truth"}},
  "figures": [{"title": "F", "x": "x", "y": "y", "values": [1], "series": {"a": )json"
        << cells << R"json(}}],
  "tables": [{"title": "T", "columns": ["a"], "rows": [["slope(1, a)"]]}]})json";
    const Result result = run("tables b.suite.json --effort smoke --out t --progress none");
    EXPECT_EQ(result.exitCode, 2);
    EXPECT_THAT(result.err, HasSubstr(text));
  }
}

TEST_F(Sweep, AChangedSettingRendersItsCellAlone) {
  const auto write = [&](int samples, const char* checks) {
    std::ofstream(folder / "many.json") << R"({
  "scene": "scene.json", "path": "path.json", "frames": "1", "image": {"width": 32, "height": 24},
  "methods": [{"method": "reference", "max_standard_error": 0, "name": "a", "samples": 1, "rays": 1},
              {"method": "reference", "max_standard_error": 0, "name": "b", "samples": )"
                                        << samples << R"(, "rays": 1},
              {"method": "reference", "max_standard_error": 0, "name": "truth", "samples": 4, "rays": 1}]})";
    std::ofstream(folder / "b.suite.json") << R"json({"title": "B", "runs": {
  "times": {"config": "many.json", "against": "truth"},
  "errors": {"config": "many.json", "against": "truth", "times": false}},
  "efforts": {"smoke": {"image.height": 12}}, "checks": )json"
                                           << checks << R"json(,
  "tables": [{"title": "T", "columns": ["a", "b", "ratio"], "rows": [
    ["error(errors.a, L1_8bit)", "error(errors.b, L1_8bit)", "ratio(times.a, times.b)"]]}]})json";
  };
  const std::string command = "tables b.suite.json --effort smoke --out t --progress none ";
  write(2, "[]");
  const Result first = run(command);
  ASSERT_EQ(first.exitCode, 0) << first.err;
  const Result nowhere = run("tables b.suite.json --effort smoke --out /proc/nope");
  EXPECT_EQ(nowhere.exitCode, 5) << nowhere.err;
  EXPECT_THAT(nowhere.err, HasSubstr("/proc/nope: cannot be created"));
  EXPECT_THAT(first.err, HasSubstr("times: 9 frames rendered"));   // three, first, warm and timed
  EXPECT_THAT(first.err, HasSubstr("errors: 3 frames rendered"));  // three
  write(3, R"json([{"value": "error(errors.b, L1_8bit)", "from": 100, "to": 101}])json");
  const Result second = run(command + "--check");
  EXPECT_EQ(second.exitCode, 7) << second.err;
  EXPECT_THAT(second.err, HasSubstr("expected 100 to 101"));
  EXPECT_THAT(second.err, HasSubstr("times: 6 frames rendered"));  // b, beside the truth
  EXPECT_THAT(second.err, HasSubstr("errors: 1 frames rendered"));
  EXPECT_THAT(textOf(folder / "t/tables.md"), HasSubstr("too few rounds"));
}

TEST_F(Sweep, ValuesOfAFileAreMeasuredAgainWhereTheirSettingsChanged) {
  const auto write = [&](int samples, const std::string& title) {
    std::ofstream(folder / "v.json") << R"({
  "scene": "scene.json", "path": "path.json", "frames": "1-2", "image": {"width": 32, "height": 24},
  "methods": [{"method": "reference", "max_standard_error": 0, "name": "a", "samples": 1, "rays": 1},
              {"method": "reference", "max_standard_error": 0, "name": "b", "samples": )"
                                     << samples << R"(, "rays": 1},
              {"method": "reference", "max_standard_error": 0, "name": "truth", "samples": 4, "rays": 1}]})";
    std::ofstream(folder / "v.suite.json")
        << R"json({"title": ")json" << title << R"json(", "runs": {
  "errors": {"config": "v.json", "against": "truth", "times": false},
  "more": {"config": "v.json", "against": "truth", "times": false}},
  "tables": [{"title": "T", "columns": ["a", "b", "rays"], "rows": [
    ["spread(error, errors.a, L1_8bit)", "error(errors.b, L1_8bit)", "spread(mean, more.a, rays)"]]}]})json";
  };
  const auto command = [&](const std::string& out) {
    return "tables v.suite.json --values v.values.json --into v.md --progress none --out " + out +
           " ";
  };
  std::ofstream(folder / "v.md") << "Old.\n\n<!-- table 1 -->\n<!-- end -->\n";
  write(2, "V");
  EXPECT_EQ(run(command("one") + "--text-only").exitCode, 2);  // no values yet
  ASSERT_EQ(run(command("one")).exitCode, 0);
  const std::string page = textOf(folder / "v.md");
  const std::string values = textOf(folder / "v.values.json");
  EXPECT_THAT(
      page, testing::ContainsRegex("\\| [0-9.]+ / [0-9.]+ \\| [0-9.]+ \\| [0-9.]+ / [0-9.]+ \\|"));
  // In another folder, where nothing was rendered, another title and text: the file is enough.
  write(2, "Other");
  std::ofstream(folder / "v.md") << "New.\n\n<!-- table 1 -->\n<!-- end -->\n";
  const Result again = run(command("two") + "--text-only");
  ASSERT_EQ(again.exitCode, 0) << again.err;
  EXPECT_EQ(textOf(folder / "v.md"), "New." + page.substr(4));
  EXPECT_THAT(textOf(folder / "two/tables.md"), HasSubstr("Other"));
  // One method's setting: its cells alone, beside the reference.
  write(3, "Other");
  const Result stale = run(command("three") + "--text-only");
  EXPECT_EQ(stale.exitCode, 2);
  EXPECT_THAT(stale.err, HasSubstr("the run errors"));
  const Result third = run(command("three"));
  ASSERT_EQ(third.exitCode, 0) << third.err;
  EXPECT_THAT(third.err, HasSubstr("errors: 4 frames rendered"));  // two of b, two of the truth
  EXPECT_THAT(third.err, testing::Not(HasSubstr("more: ")));
  const std::string changed = textOf(folder / "v.values.json");
  EXPECT_NE(changed, values);
  const auto line = [](const std::string& text, const std::string& cell) {
    const std::size_t at = text.find("\"" + cell);
    return text.substr(at, text.find('\n', at) - at);
  };
  for (const char* cell : {"spread(error, errors.a", "spread(mean, more.a"})
    EXPECT_EQ(line(changed, cell), line(values, cell));
  EXPECT_NE(line(changed, "error(errors.b"), line(values, "error(errors.b"));
}

TEST_F(Sweep, SuitesPatchScenesAndDrawPictures) {
  fs::create_directory(folder / "beside");
  const auto write = [&](const std::string& label, const std::string& patch) {
    std::ofstream(folder / "p.suite.json")
        << R"json({"title": "P", "runs": {
  "plain": {"config": "run.json", "against": "truth", "times": false},
  "patched": {"config": "run.json", "against": "truth", "times": false, "scene_patch": )json"
        << patch << R"json(, "path_patch": [{"op": "add", "path": "/fov", "value": 30}]}},
  "tables": [],
  "figures": [{"title": "F", "file": "f.svg", "x": "run", "y": "L1", "values": [1], "series":
               {"a": ["error(plain.reference, L1_8bit)"]}}],
  "pictures": [{"file": "p.svg", "frame": 2, "against": "truth", "rows": [
    [{"of": "plain.reference", "zoom": 8, "label": ")json"
        << label << R"json("}, {"of": "patched.truth", "crop": [1, 2, 3, 4], "zoom": 5}],
    [{"of": "plain.reference", "difference": 9}]]}]})json";
  };
  const std::string command =
      "tables p.suite.json --pictures pictures --values p.values.json --progress none --out ";
  const std::string patch = R"([{"op": "add", "path": "/name", "value": "other"}])";
  write("L1 {error}, {mean(plain.reference, rays)} rays", patch);
  const Result first = run(command + "one");
  ASSERT_EQ(first.exitCode, 0) << first.err;
  const std::string picture = textOf(folder / "pictures/p.svg");
  EXPECT_THAT(picture, testing::ContainsRegex(">L1 [0-9.]+, [0-9.]+ rays</text>"));
  EXPECT_THAT(picture, HasSubstr("width=\"15\" height=\"20\""));
  EXPECT_THAT(textOf(folder / "pictures/f.svg"), HasSubstr("<svg"));
  EXPECT_THAT(textOf(folder / "one/scenes/patched.scene.json"), HasSubstr("\"other\""));
  EXPECT_THAT(textOf(folder / "one/scenes/patched.path.json"), HasSubstr("30"));
  EXPECT_TRUE(fs::exists(folder / "one/scenes/beside"));
  // Nothing has changed: nothing is rendered or drawn
  const Result second = run(command + "two");
  ASSERT_EQ(second.exitCode, 0) << second.err;
  EXPECT_THAT(second.err, testing::Not(HasSubstr("picture: ")));
  EXPECT_THAT(second.err, testing::Not(HasSubstr("rendered")));
  write("{error}", patch);
  EXPECT_THAT(run(command + "two").err, HasSubstr("picture: pictures/p.svg"));
  write("{error}", R"([{"op": "remove", "path": "/gone"}])");
  const Result wrong = run(command + "two");
  EXPECT_EQ(wrong.exitCode, 2) << wrong.err;
  EXPECT_THAT(wrong.err, HasSubstr("/runs/patched/scene_patch: this patch cannot be applied to "));
  EXPECT_THAT(wrong.err, HasSubstr("gone"));
}

TEST_F(Sweep, TablesAreMadeAgainWithoutRendering) {
  const auto write = [&](const std::string& title, const std::string& samples) {
    std::ofstream(folder / "a.suite.json")
        << R"json({"title": "A", "runs": {
  "one": {"config": "run.json", "settings": {"methods.reference.samples": )json"
        << samples << R"json(}, "frames": {"smoke": "1"}, "against": "truth"},
  "two": {"config": "run.json", "frames": {"smoke": "2"}, "against": "truth"}},
  "tables": [{"title": ")json"
        << title << R"json(", "columns": ["run", "ms", "L1_8bit"], "rows": [
    ["one", "ms(one.reference)", "error(one.reference, L1_8bit)"],
    ["two", "ms(two.reference)", "18 (25, 13)"]]}],
  "figures": [{"title": "F", "x": "run", "y": "ms", "values": [1, 2],
               "series": {"reference": ["ms(one.reference)", "ms(two.reference)"]}}]})json";
  };
  const std::string command = "tables a.suite.json --effort smoke --out t --progress none ";
  write("Before", "1");
  const Result first = run(command + "--format md,csv,json,tex,html");
  ASSERT_EQ(first.exitCode, 0) << first.err;
  const config::Value table =
      config::parseFile(folder / "t/tables.json").get("tables").asArray()[0];
  EXPECT_EQ(table.get("columns").asArray()[2].asString(), "L1_8bit");
  EXPECT_EQ(table.get("rows").asArray()[1].asArray()[2].asString(), "18 (25, 13)");
  EXPECT_GT(table.get("rows").asArray()[0].asArray()[1].asNumber(), 0.0);
  EXPECT_THAT(first.err, HasSubstr("one: "));
  EXPECT_THAT(first.err, HasSubstr("two: "));
  EXPECT_THAT(textOf(folder / "t/tables.md"), HasSubstr("18 (25, 13)"));
  // Another text: nothing is rendered. Another setting of one run: that run alone.
  write("After", "1");
  const Result second = run(command);
  EXPECT_THAT(second.err, testing::Not(HasSubstr("frames rendered")));
  EXPECT_THAT(textOf(folder / "t/tables.md"), HasSubstr("After"));
  EXPECT_EQ(run(command + "--text-only").exitCode, 0);
  write("After", "2");
  EXPECT_EQ(run(command + "--text-only").exitCode, 2);
  const Result third = run(command);
  EXPECT_THAT(third.err, HasSubstr("one: "));
  EXPECT_THAT(third.err, testing::Not(HasSubstr("two: ")));
  // The page's own text stays
  std::ofstream(folder / "page.md") << "Text.\n\n<!-- table 1 -->\nold\n<!-- end -->\nMore.\n";
  EXPECT_EQ(run(command + "--into page.md").exitCode, 0);
  const std::string page = textOf(folder / "page.md");
  EXPECT_THAT(page, testing::StartsWith("Text.\n\n<!-- table 1 -->\n\n| run | ms |"));
  EXPECT_THAT(page, testing::EndsWith("<!-- end -->\nMore.\n"));
  EXPECT_THAT(page, testing::Not(HasSubstr("old")));
  std::ofstream(folder / "page.md") << "<!-- table 2 -->\n<!-- end -->\n";
  EXPECT_THAT(run(command + "--into page.md").err, HasSubstr("the suite has 1 tables"));
  std::ofstream(folder / "a.suite.json")
      << R"json({"title": "A", "runs": {"one": {"config": "run.json", "against": "truth"}},
 "tables": [{"title": "T", "columns": ["x"], "rows": [["ms(ome.reference)"]]}]})json";
  const Result wrong = run(command);
  EXPECT_EQ(wrong.exitCode, 2);
  EXPECT_THAT(wrong.err, HasSubstr("did you mean \"one\"?"));
  EXPECT_THAT(wrong.err, testing::Not(HasSubstr("frames rendered")));
}

}  // namespace
}  // namespace catoptric::app
