// The command sweep, and repeats of a run, as programs.
#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <csignal>

#include "app/test_program.h"
#include "config/json.h"

namespace catoptric::app {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

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

class Sweep : public Study {};

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

TEST_F(Sweep, CamerasReachTheWorkers) {
  const std::string sweep =
      "sweep scene.json --method environment_map,traced --against traced --repeats 1 --progress "
      "none "
      "--set image.width=32 --set image.height=24 --frames 1 ";
  std::set<std::string> seen;
  for (const char* camera : {"front", "three_quarter", "1,2,3/0,0.5,0/40"}) {
    const std::string out = "c" + std::to_string(seen.size());
    const Result result = run(sweep + "--camera " + camera + " --out " + out);
    ASSERT_EQ(result.exitCode, 0) << result.err;
    for (const auto& file : fs::directory_iterator(folder / out / "errors"))
      EXPECT_TRUE(seen.insert(textOf(file.path())).second) << camera;
  }
}

TEST_F(Sweep, ShadersOfAFolderReachTheWorkers) {
  const fs::path file = folder / "src/methods/environment_map/shaders/lookup.frag";
  fs::create_directories(file.parent_path());
  const std::string sweep =
      "sweep scene.json --method environment_map,traced --against traced --repeats 0 --progress "
      "none --set image.width=32 --set image.height=24 --frames 1 --camera front --out s "
      "--existing resume --shader-dir src";
  const Result own = run(sweep);
  EXPECT_EQ(own.exitCode, 0) << own.err;
  std::ofstream(file) << "no shader\n";  // what was measured with others is measured again
  const Result wrong = run(sweep);
  EXPECT_EQ(wrong.exitCode, 6) << wrong.err;
  EXPECT_THAT(wrong.err, HasSubstr("lookup.frag"));
}

TEST_F(Sweep, AssetFoldersReachTheWorkers) {
  fs::create_directory(folder / "parts");
  std::ofstream(folder / "parts/triangle.gltf") << R"({"asset": {"version": "2.0"},
  "buffers": [{"byteLength": 36, "uri": "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}],
  "bufferViews": [{"buffer": 0, "byteLength": 36}],
  "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
  "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}], "nodes": [{"mesh": 0}]})";
  std::ofstream(folder / "scene.json") << R"({"objects": [{"asset": "triangle.gltf"}]})";
  const Result result =
      run(std::string(kSweep) + "--vary seed=1,2 --frames 1 --asset-path parts --out s");
  EXPECT_EQ(result.exitCode, 0) << result.err;
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
      {"--vary samples=1,2", "name it methods.reference.samples"},
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

TEST_F(Sweep, AReferenceThatIsNotThereIsSaidAtOnce) {
  const std::string command = "sweep run.json --method reference --vary threads=1 --out s ";
  const Result method = run(command + "--against trut");
  EXPECT_EQ(method.exitCode, 2);
  EXPECT_THAT(method.err, HasSubstr("did you mean \"truth\"?"));
  EXPECT_EQ(run("render run.json --method truth --frames 1,3 --out r -q").exitCode, 0);
  const Result frames = run(command + "--against r --frames 1-4");
  EXPECT_EQ(frames.exitCode, 2);
  EXPECT_THAT(frames.err, HasSubstr("the reference r lacks frames 2,4"));
  EXPECT_FALSE(fs::exists(folder / "s"));
}

TEST_F(Sweep, KeepsItsBudgetAndSaysWhatIsMissing) {
  const auto sweep = [&](const std::string& options) {
    const auto start = std::chrono::steady_clock::now();
    const Result result =
        run("sweep run.json --method reference --set methods.reference.rays=1 --against truth "
            "--progress none --existing resume --out s " +
            options);
    EXPECT_EQ(result.exitCode, 0) << result.err;
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
    EXPECT_LT(seconds.count(), 20.0);  // of a machine that does other things, too
    return result.out;
  };
  // A frame takes half a second: the time is over in the round that warms up
  const std::string none = sweep("--vary methods.reference.samples=63,64 --budget 0.01");
  EXPECT_THAT(none, HasSubstr("2 of 2 points have no errors, or fewer than 8 rounds"));
  EXPECT_THAT(none, HasSubstr("unmeasured"));
  // Hours, without a budget. What there is has intervals, and is kept
  const std::string vary = "--vary methods.reference.samples=15,16 --frames 1 ";
  EXPECT_THAT(sweep(vary + "--repeats 1000 --budget 0.05"),
              AllOf(HasSubstr("fewer than 1000 rounds"), HasSubstr(" to ")));
  EXPECT_THAT(sweep(vary), Not(HasSubstr("budget")));
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

TEST_F(Sweep, RepeatsOfARunSayHowFarRatiosHold) {
  const std::string command = "render run.json --out r --existing overwrite --frames 1-2 -q ";
  const Result result = run(command + "--repeats 8 --ratio-to truth");
  EXPECT_EQ(result.exitCode, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("interleaved rounds; x: time divided by that of truth"));
  EXPECT_THAT(result.out, HasSubstr(" to 0."));
  EXPECT_THAT(result.out, HasSubstr("mean of 6 frames"));
  EXPECT_THAT(result.out + result.err, Not(HasSubstr("--repeats 8")));
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

}  // namespace
}  // namespace catoptric::app
