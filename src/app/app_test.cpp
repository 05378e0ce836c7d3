// The program as its users run it: exit codes, what stands on stdout and stderr, run folders.
// `reference` needs no OpenGL; app_gl_test.cpp renders with it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <map>
#include <thread>

#include "app/test_program.h"
#include "config/json.h"

namespace catoptric::app {
namespace {

using testing::HasSubstr;
using testing::Not;

TEST_F(App, UsageErrorsAreExit2AndHelp) {
  const Result command = run("rendr run.json");
  EXPECT_EQ(command.exitCode, 2);
  EXPECT_EQ(command.out, "");
  EXPECT_THAT(command.err, HasSubstr("unknown command \"rendr\" (did you mean \"render\"?)"));
  const Result option = run("render run.json --frmes 1");
  EXPECT_EQ(option.exitCode, 2);
  EXPECT_THAT(option.err, HasSubstr("unknown option --frmes (did you mean \"--frames\"?)"));
  const Result method = run("render run.json --method refrence");
  EXPECT_EQ(method.exitCode, 2);
  EXPECT_THAT(method.err, HasSubstr("\"refrence\" is not a method (did you mean \"reference\"?)"));
  EXPECT_THAT(run("render run.jso").err,
              HasSubstr("run.jso: no such file (did you mean \"run.json\"?)"));
  EXPECT_THAT(run("render run.json --existing keep").err,
              HasSubstr("allowed: error, overwrite, resume"));
  EXPECT_THAT(run("render run.json --chunk 3/2").err, HasSubstr("--chunk: \"3/2\""));
  EXPECT_THAT(run("render run.json --device gpu").err, HasSubstr("gpu"));
  EXPECT_EQ(run("render run.json --device gpu").exitCode, 2);
  EXPECT_EQ(run("render run.json --threads few").exitCode, 2);
  EXPECT_EQ(run("render run.json --frames 1-99").exitCode, 2);
  EXPECT_EQ(run("").exitCode, 2);
  EXPECT_EQ(run("render").exitCode, 2);
  EXPECT_FALSE(fs::exists(folder / "out"));
}

TEST_F(App, LensesThatShowNothingAreWarnedOf) {
  std::ofstream(folder / "lens.json") << R"({"objects": [
  {"name": "lens", "shape": "implicit", "surface": "sphere", "radius": 0.5, "segments": [8, 6],
   "material": {"base_color": [0.1, 0.1, 0.1], "s": 1, "g": 0, "refraction": 1.5}}]})";
  for (const std::string method : {"perturbation", "traced", "reference"}) {
    const std::string option = "methods." + method + ".bounces";
    const std::string image = " --set image.width=8 --set image.height=8 --method " + method;
    const Result plan = run("plan lens.json" + image + " --set " + option + "=1");
    EXPECT_EQ(plan.exitCode, 0) << plan.err;
    EXPECT_THAT(plan.err, HasSubstr("set " + option + "=2 or more"));
    EXPECT_EQ(run("plan lens.json -q" + image + " --set " + option + "=2").err, "");
  }
  // Also among others, which have no such option of their entry
  std::ofstream(folder / "both.json") << R"({"objects": [
  {"name": "lens", "shape": "implicit", "surface": "sphere", "radius": 0.5, "segments": [8, 6],
   "material": {"base_color": [0.1, 0.1, 0.1], "s": 1, "g": 0, "refraction": 1.5}},
  {"name": "ball", "shape": "sphere", "radius": 0.2, "segments": [8, 6],
   "translate": [1, 0, 0], "material": {"s": 1, "g": 0}}]})";
  for (const char* const others :
       {R"({"lens": "traced", "ball": "environment_map"})", R"({"lens": "traced"})"}) {
    std::ofstream(folder / "mixed.json")
        << R"({"scene": "both.json", "image": {"width": 8, "height": 8}, "methods": [
           {"method": "second_order", "name": "mixed", "reflectors": )"
        << others << "}]}";
    EXPECT_THAT(
        run("plan mixed.json").err,
        HasSubstr(
            "mixed: nothing can be seen through \"lens\": entering and leaving an object takes 2 "
            "bounces, but bounces is 1; give the method that renders it bounces 2 or more"));
  }
  EXPECT_THAT(run("render lens.json --method perturbation --set methods.perturbation.bounces=2 "
                  "--set methods.perturbation.order=nearest --set image.width=8 "
                  "--set image.height=8 --out near")
                  .err,
              HasSubstr("\"lens\" refracts; with \"order\": \"nearest\""));
  EXPECT_THAT(run("render lens.json --method reference --set image.width=8 --set image.height=8 "
                  "--set methods.reference.bounces=1")
                  .err,
              HasSubstr("nothing can be seen through \"lens\""));
}

TEST_F(App, FallbacksTakeOptionsAlsoWhereTheirNameAloneIsGiven) {
  std::ofstream(folder / "ball.json") << R"({"objects": [
  {"name": "ball", "shape": "sphere", "segments": [8, 6], "material": {"s": 1, "g": 0}}]})";
  const auto plan = [&](const std::string& fallback, const std::string& options) {
    std::ofstream(folder / "fall.json")
        << R"({"scene": "ball.json", "methods": [{"method": "screen_space", "name": "mine", "fallback": ")"
        << fallback << "\"}]}";
    return run("plan fall.json --set image.width=8 --set image.height=8" + options);
  };
  const std::string option = " --set methods.mine.fallback.";
  EXPECT_THAT(plan("traced", option + "rays=0").err,
              HasSubstr("/methods/0/fallback/rays: 0 is out of range"));
  EXPECT_EQ(plan("traced", option + "rays=4").exitCode, 0);
  EXPECT_THAT(plan("black", option + "rays=4").err, HasSubstr("has no members"));
  EXPECT_THAT(plan("planar", "").err,
              HasSubstr("--set methods.mine.fallback.unsupported=environment_map (or =traced)"));
  EXPECT_EQ(plan("planar", option + "unsupported=traced").exitCode, 0);
}

TEST_F(App, ConfigErrorsNameFileLineAndPlace) {
  std::ofstream(folder / "bad.json") << "{\"scene\": \"scene.json\",\n\"image\": {\"widht\": 5}}";
  const Result result = run("plan bad.json");
  EXPECT_EQ(result.exitCode, 2);
  EXPECT_THAT(result.err,
              HasSubstr("bad.json:2: /image/widht: unknown name \"widht\" (did you mean "
                        "\"width\"?)"));
  const Result set = run("plan run.json --set image.width=0");
  EXPECT_EQ(set.exitCode, 2);
  EXPECT_THAT(set.err, HasSubstr("--set image.width=0: /image/width: 0 is out of range"));
}

TEST_F(App, UnknownInstructionSetsAreExit2) {
  for (const char* variable : {"CATOPTRIC_VECTOR_LEVEL", "CATOPTRIC_EMBREE_ISA"}) {
    ASSERT_EQ(setenv(variable, "v9", 1), 0);
    const Result result = run("render run.json --out r --set methods.reference.samples=1");
    unsetenv(variable);
    EXPECT_EQ(result.exitCode, 2) << result.err;
    EXPECT_THAT(result.err, HasSubstr(std::string(variable) + " is 'v9'; allowed: "));
  }
}

TEST_F(App, MissingScenesAreExit3) {
  const Result result = run("render run.json --set scene=nothing.json --out o");
  EXPECT_EQ(result.exitCode, 3);
  EXPECT_THAT(result.err, HasSubstr("nothing.json"));
  EXPECT_EQ(run("render nothing.glb --out o").exitCode, 3);
}

TEST_F(App, OptionsInTheWrongFormAreShownInTheRightOne) {
  EXPECT_THAT(run("render run.json --outdir x").err, HasSubstr("(did you mean \"--out\"?)"));
  EXPECT_THAT(run("render run.json --set rays=4").err,
              HasSubstr("\"rays\" is an option of a method; name it methods.reference.rays"));
  EXPECT_THAT(run("render run.json --set image.layers=Z").err,
              HasSubstr("did you mean --set 'image.layers=[\"Z\"]'?"));
  const Result scene = run("render run.json --set scene=absent.json");
  EXPECT_EQ(scene.exitCode, 3);
  EXPECT_THAT(scene.err,
              HasSubstr("there is no file absent.json (names given by --set are relative "
                        "to the current folder)"));
}

TEST_F(App, BlackFramesAreWarnedOf) {
  const Result black = run("render run.json --frames 1 --environment '#000000' --out black");
  EXPECT_EQ(black.exitCode, 0);
  EXPECT_THAT(black.err, HasSubstr("warning: frame 1 is completely black"));
  const Result lit = run("render run.json --frames 1 --environment 0.5,0.5,0.5 --out lit");
  EXPECT_THAT(lit.err, testing::Not(HasSubstr("completely black")));
  EXPECT_EQ(run("render run.json --environment none.exr").exitCode, 2);
}

TEST_F(App, ScenesAndPathsMayNameTheirSchema) {
  const std::string schema = R"({"$schema": "x.json", )";
  for (const char* file : {"scene.json", "path.json"}) {
    const std::string text = textOf(folder / file);
    std::ofstream(folder / file) << schema + text.substr(1);
  }
  EXPECT_EQ(run("render run.json --dry-run").err, "");
}

TEST_F(App, FindsWhatIsListedByItsName) {
  for (const char* kind : {"configs", "scenes", "paths"}) fs::create_directories(folder / kind);
  fs::rename(folder / "run.json", folder / "configs/room.json");
  for (const char* name : {"scene", "hall", "room"})
    fs::copy_file(folder / "scene.json", folder / "scenes" / (std::string(name) + ".json"));
  fs::copy_file(folder / "scene.json", folder / "configs/scene.json");
  fs::rename(folder / "path.json", folder / "configs/path.json");
  EXPECT_EQ(run("plan room --frames 1").exitCode, 0);
  EXPECT_EQ(run("plan hall.json --frames 1").exitCode, 0);
  EXPECT_THAT(run("info room").out, HasSubstr("(scenes/room.json)"));
  EXPECT_EQ(run("render room --frames 1 -q").exitCode, 0);
  EXPECT_TRUE(fs::exists(folder / "out/room/frames/frame.0001.exr"));
}

TEST_F(App, WrongFilesAreNamedInOneLine) {
  const auto lines = [](const Result& result) {
    return std::count(result.err.begin(), result.err.end(), '\n');
  };
  const auto refuses = [&](const std::string& arguments, int code, const char* text) {
    const Result result = run(arguments);
    EXPECT_EQ(result.exitCode, code) << arguments;
    EXPECT_THAT(result.err, HasSubstr(text)) << arguments;
    EXPECT_EQ(lines(result), 1) << arguments << result.err;
  };
  refuses("plan path.json", 2, "path.json: is a camera path");
  refuses("plan run.json --set scene=run.json", 2, "run.json: is a run config");
  refuses("plan run.json --set scene=path.json", 2, "path.json: is a camera path");
  refuses("plan run.json --set path=scene.json", 2, "scene.json: is a scene");
  refuses("plan /dev/null", 2, "/dev/null: is not a regular file");
  ASSERT_EQ(::mkfifo((folder / "pipe.json").c_str(), 0600), 0);
  refuses("plan pipe.json", 2, "pipe.json: is not a regular file");
  refuses("plan run.json --set scene=pipe.json", 3, "pipe.json");
  std::ofstream(folder / "model.blend") << "BLENDER-v304";
  refuses("plan model.blend", 2, "model.blend: is neither a run config nor a scene; scenes are");
  fs::create_directories(folder / "configs");
  refuses("plan roon", 2, "roon: no such file; `catoptric list scenes configs` lists");
  std::ofstream(folder / "broken.json") << "{\"objects\": [";
  refuses("plan run.json --set scene=broken.json", 3, "broken.json:1");
  // Frames and devices are checked before the scene is loaded.
  refuses("plan run.json --set scene=nothing.json --frames 1-2-3", 2, "1-2-3");
  refuses("plan run.json --set scene=nothing.json --device gpu", 2, "gpu");
  EXPECT_EQ(run("render run.json --out ''").exitCode, 2);
  EXPECT_EQ(run("render run.json --frames ''").exitCode, 2);
  EXPECT_FALSE(fs::exists(folder / "out"));
}

TEST_F(App, DoctorTellsOfTheCache) {
  fs::create_directories(folder / "cache/catoptric");
  std::ofstream(folder / "cache/catoptric/bake-1.bin") << "12345";
  const config::Value cache = config::parseText(run("doctor --json").out, "doctor").get("cache");
  EXPECT_EQ(cache.get("folder").asString(), (folder / "cache/catoptric").string());
  EXPECT_EQ(cache.get("files").asInteger(), 1);
  EXPECT_EQ(cache.get("bytes").asInteger(), 5);
  EXPECT_THAT(run("doctor").out,
              HasSubstr("cache: " + (folder / "cache/catoptric").string() + ", 1 file, "));
}

TEST_F(App, RendersResumesAndRefuses) {
  const Result first = run("render run.json --out a --frames 1-3");
  ASSERT_EQ(first.exitCode, 0) << first.err;
  EXPECT_THAT(first.out, HasSubstr("trace"));  // the table
  EXPECT_THAT(first.err, HasSubstr("reference: 3/3"));
  for (const char* file :
       {"frames/frame.0003.exr", "previews/frame.0001.png", "timings.csv", "summary.json",
        "frames.jsonl", "table.md", "table.csv", "contact_sheet.png"})
    EXPECT_TRUE(fs::exists(folder / "a" / file)) << file;

  const auto before = frames("a");
  const Result refused = run("render run.json --out a");
  EXPECT_EQ(refused.exitCode, 5);
  EXPECT_THAT(refused.err, HasSubstr("--existing resume"));
  EXPECT_EQ(frames("a"), before);

  const Result resumed = run("render run.json --out a --existing resume --json -q");
  ASSERT_EQ(resumed.exitCode, 0) << resumed.err;
  const config::Value result = config::parseText(resumed.out, "out").get("methods").asArray()[0];
  EXPECT_EQ(result.get("reused").dump(), "[1,2,3]");
  EXPECT_EQ(result.get("rendered").dump(), "[4,5,6]");
  const config::Value timings =
      config::parseText(resumed.out, "out").get("timings").asArray().at(0);
  EXPECT_EQ(timings.get("frames").asInteger(), 6);
  EXPECT_GT(timings.get("rendering").get("median").asNumber(), 0.0);

  // Whole, in one process and one thread; and in chunks: the same bytes.
  ASSERT_EQ(run("render run.json --out b --threads 1").exitCode, 0);
  EXPECT_EQ(frames("a"), frames("b"));
  ASSERT_EQ(run("render run.json --out c1 --chunk 1/2").exitCode, 0);
  ASSERT_EQ(run("render run.json --out c2 --chunk 2/2").exitCode, 0);
  auto pieces = frames("c1");
  pieces.merge(frames("c2"));
  EXPECT_EQ(pieces, frames("b"));

  // A changed setting is not trusted.
  const Result changed = run("render run.json --out a --existing resume --seed 2 --json");
  ASSERT_EQ(changed.exitCode, 0) << changed.err;
  EXPECT_THAT(changed.err, HasSubstr("differences in method or image settings"));
}

TEST_F(App, BareScenesRenderWithoutConfig) {
  const Result result = run(
      "render scene.json --method reference --set image.width=16 --set image.height=16 --out s");
  ASSERT_EQ(result.exitCode, 0) << result.err;
  EXPECT_TRUE(fs::exists(folder / "s/frames/frame.0001.exr"));
  EXPECT_EQ(run("plan scene.json --set methods.0.bvh=refit").exitCode, 0);
  EXPECT_EQ(run("plan scene.json --method reference --set methods.0.samples=2").exitCode, 0);
}

TEST_F(App, DryRunAndPlanWriteNothing) {
  const Result dry = run("render run.json --out d --dry-run");
  EXPECT_EQ(dry.exitCode, 0) << dry.err;
  EXPECT_THAT(dry.out, HasSubstr("d: frames 1-6 would be rendered\n"));
  const config::Value chunk =
      config::parseText(run("render run.json --out d --dry-run --chunk 2/3 --json").out, "dry");
  EXPECT_EQ(chunk.get("methods").asArray()[0].get("rendered").dump(), "[3,4]");
  EXPECT_FALSE(fs::exists(folder / "d"));
  const config::Value plan = config::parseText(run("plan run.json --json").out, "plan");
  EXPECT_FALSE(plan.get("context").asBool());  // reference alone needs no OpenGL
  EXPECT_EQ(plan.get("frames").asInteger(), 6);
}

TEST_F(App, DryRunsEndAsTheRunWould) {
  ASSERT_EQ(run("render run.json --out d --frames 1-3").exitCode, 0);
  const Result refused = run("render run.json --out d --dry-run");
  EXPECT_EQ(refused.exitCode, 5);
  EXPECT_EQ(refused.err, run("render run.json --out d").err);
  fs::remove(folder / "d/frames/frame.0002.exr");
  const Result resumed = run("render run.json --out d --dry-run --existing resume");
  EXPECT_EQ(resumed.exitCode, 0);
  EXPECT_THAT(resumed.out, HasSubstr("d: frames 2,4-6 would be rendered, frames 1,3 re-used"));
  EXPECT_THAT(resumed.err,
              HasSubstr("d: frame 2 is rendered again: frames/frame.0002.exr is missing"));
  EXPECT_THAT(run("render run.json --out d --dry-run --existing overwrite").out,
              HasSubstr("replacing the existing run"));
  EXPECT_TRUE(fs::exists(folder / "d/frames/frame.0003.exr"));
}

TEST_F(App, AFailedStartDoesNotBlockTheNext) {
  const std::string arguments = "render run.json --method traced --out d --device ";
  EXPECT_EQ(run(arguments + "egl:99").exitCode, 4);
  EXPECT_FALSE(fs::exists(folder / "d"));
  std::ofstream(folder / "two.json") << R"({"scene": "scene.json", "path": "path.json",
    "methods": ["traced", "environment_map"]})";
  EXPECT_EQ(run("render two.json --out a/b --device egl:99").exitCode, 4);
  EXPECT_FALSE(fs::exists(folder / "a"));
}

TEST_F(App, SettingsNameMethods) {
  std::ofstream(folder / "two.json") << R"({"scene": "scene.json", "path": "path.json",
    "methods": ["traced", {"method": "traced", "name": "fit"}]})";
  // By name or number, also where the config gives a name alone; the other keeps its options
  for (const char* setting : {"methods.fit.bvh=refit", "methods.1.bvh=refit"}) {
    const Result plan = run(std::string("plan two.json --json --method fit --set ") + setting);
    EXPECT_EQ(plan.exitCode, 0) << plan.err;
    EXPECT_EQ(plan.out, run("plan two.json --json --method fit --set methods.1.bvh=refit").out);
  }
  EXPECT_EQ(run("plan two.json --set methods.traced.bvh=refit").exitCode, 0);
  EXPECT_THAT(run("plan two.json --set methods.traced.bvh=refitt").err, HasSubstr("refitt"));
  EXPECT_THAT(run("plan two.json --set methods.fitt.bvh=refit").err,
              HasSubstr("no method \"fitt\" (did you mean \"fit\"?); it has traced, fit"));
}

TEST_F(App, FoldersOfSeveralRunsAreNamed) {
  std::ofstream(folder / "two.json") << R"({"scene": "scene.json", "path": "path.json",
    "image": {"width": 32, "height": 24}, "frames": "1",
    "methods": [{"method": "reference", "max_standard_error": 0, "name": "a", "samples": 1, "rays": 1},
                {"method": "reference", "max_standard_error": 0, "name": "b", "samples": 2, "rays": 1}]})";
  EXPECT_EQ(run("render two.json --out out").exitCode, 0);
  const Result one = run("render two.json --out out --method a --existing resume");
  EXPECT_EQ(one.exitCode, 2);
  EXPECT_THAT(one.err, HasSubstr("for one of these methods use --out out/a"));
  EXPECT_FALSE(fs::exists(folder / "out" / "frames"));
  EXPECT_EQ(run("render two.json --out out/a --method a --existing resume").exitCode, 0);
  const Result compare = run("compare out out/a");
  EXPECT_EQ(compare.exitCode, 2);
  EXPECT_THAT(compare.err, HasSubstr("has several runs; choose one of out/a, out/b"));
  // Objects by name, too
  EXPECT_EQ(run("render two.json --out ids --set 'image.layers=[\"s\",\"id\"]'").exitCode, 0);
  EXPECT_THAT(run("compare ids/a ids/b").out, HasSubstr("ball"));
}

TEST_F(App, InfoCounts) {
  EXPECT_THAT(
      run("info run.json").err,
      HasSubstr(
          "run.json: is a run config, not a scene. For its scene: catoptric info scene.json"));
  const config::Value info = config::parseText(run("info scene.json --json").out, "info");
  EXPECT_EQ(info.get("objects").asInteger(), 2);
  EXPECT_EQ(info.get("reflective_objects").asInteger(), 1);
  EXPECT_GT(info.get("reflective_share").asNumber(), 0.01);
  EXPECT_LT(info.get("reflective_share").asNumber(), 0.9);
  EXPECT_EQ(info.get("diffuse_triangles").asInteger(), 2);
  ASSERT_EQ(info.get("reflectors").asArray().size(), 1u);
  EXPECT_EQ(info.get("reflectors").asArray()[0].get("name").asString(), "ball");
  EXPECT_THAT(run("info scene.json").out, HasSubstr("ball"));
}

TEST_F(App, CompareHasLimits) {
  ASSERT_EQ(run("render run.json --out a --frames 1").exitCode, 0);
  ASSERT_EQ(run("render run.json --out b --frames 1 --set methods.0.samples=1").exitCode, 0);
  const Result same = run("compare a a --max-l1 0");
  EXPECT_EQ(same.exitCode, 0) << same.err;
  EXPECT_THAT(same.out, testing::Not(HasSubstr("Stability")));  // of one frame
  const Result different = run("compare a b --max-l1 0");
  EXPECT_EQ(different.exitCode, 7) << different.err;
  EXPECT_THAT(different.err, HasSubstr("more than the 0.000 allowed"));
  EXPECT_EQ(run("compare a a --fail 0 --hard-fail 0 --max-mean 0").exitCode, 0);
  EXPECT_EQ(run("compare a b --fail 0 --fail-percent 100").exitCode, 0);
  for (const auto& [limit, said] : std::map<std::string, std::string>{
           {"--fail 0", "% of the pixels differ by more than 0; --fail-percent"},
           {"--hard-fail 0.001", "more than the 0.001 allowed"},
           {"--max-mean 1e-6", "difference is 0.011095, more than the 1e-06"}}) {
    const Result failed = run("compare a b " + limit);
    EXPECT_EQ(failed.exitCode, 7) << limit;
    EXPECT_THAT(failed.err, HasSubstr(said));
  }
}

TEST_F(App, SignalsLeaveAResumableRun) {
  // More frames than may wait for the writers when the first is on the disk
  std::ofstream(folder / "path.json")
      << R"({"frames": 24, "orbit": {"center": [0, 0.5, 0], "radius": 3, "height": 0.8}})";
  const std::string arguments =
      "render run.json --set image.width=200 --set image.height=150 --set "
      "methods.0.samples=8 --out s";
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    ::chdir(folder.c_str());
    ::freopen("child.txt", "w", stderr);
    ::freopen("child_out.txt", "w", stdout);
    ::execl(CATOPTRIC_PROGRAM, "catoptric", "render", "run.json", "--set", "image.width=200",
            "--set", "image.height=150", "--set", "methods.0.samples=8", "--out", "s", nullptr);
    ::_exit(99);
  }
  for (int i = 0; i < 600 && !fs::exists(folder / "s/frames.jsonl"); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  ::kill(child, SIGTERM);
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 128 + SIGTERM) << textOf(folder / "child.txt");
  EXPECT_THAT(textOf(folder / "child.txt"), HasSubstr("are missing"));
  const Result resumed = run(arguments + " --existing resume --json -q");
  ASSERT_EQ(resumed.exitCode, 0) << resumed.err;
  const config::Value result = config::parseText(resumed.out, "out").get("methods").asArray()[0];
  EXPECT_GE(result.get("reused").asArray().size(), 1u);
  EXPECT_EQ(result.get("missing").dump(), "[]");
}

TEST_F(App, FullDisksAndClosedPipesAreExit5) {
  // A reader that has seen enough is no error of ours
  const std::string piped = "cd '" + folder.string() +
                            "' && (sleep 0.1; " CATOPTRIC_PROGRAM
                            " list 2>stderr.txt; echo $? >code.txt) | true";
  EXPECT_EQ(std::system(piped.c_str()), 0);
  EXPECT_EQ(textOf(folder / "code.txt"), "141\n");
  EXPECT_EQ(textOf(folder / "stderr.txt"), "");
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "this system has no /dev/full";
  const std::string command =
      "cd '" + folder.string() + "' && " CATOPTRIC_PROGRAM " list >/dev/full 2>stderr.txt";
  const int status = std::system(command.c_str());
  EXPECT_EQ(WEXITSTATUS(status), 5);
  std::ofstream(folder / "file") << "x";
  EXPECT_EQ(run("render run.json --out file").exitCode, 5);
}

TEST_F(App, AConfigMayComeFromStandardInput) {
  const Result plan = run("plan - < run.json");
  EXPECT_EQ(plan.exitCode, 0) << plan.err;
  const Result piped = run("render - --frames 2 --out piped < run.json");
  EXPECT_EQ(piped.exitCode, 0) << piped.err;
  ASSERT_EQ(run("render run.json --frames 2 --out named").exitCode, 0);
  EXPECT_EQ(frames("piped"), frames("named"));
  EXPECT_EQ(run("render - --dry-run --json < run.json").out.find("{\"out\":\"out/stdin\""), 0u);
  const Result bad = run("render - < path.json");
  EXPECT_EQ(bad.exitCode, 2);
  EXPECT_THAT(bad.err, HasSubstr("standard input:1: /"));
  EXPECT_THAT(run("render - < scene.json").err, HasSubstr("standard input: is a scene"));
  EXPECT_EQ(run("render - < /dev/null").exitCode, 2);
}

TEST_F(App, OptionsOfAMethodThatOnlyTheCommandLineNames) {
  const Result plan = run("plan run.json --method traced --set methods.traced.bvh=refit --json");
  EXPECT_EQ(plan.exitCode, 0) << plan.err;
  EXPECT_THAT(run("plan run.json --method traced --set methods.traced.bvh=refti").err,
              HasSubstr("/bvh: \"refti\""));
  EXPECT_EQ(run("plan run.json --method traced --set methods.perturbation.rays=1").exitCode, 2);
}

TEST_F(App, EnvironmentsThatAreNoFilesAreNamed) {
  EXPECT_THAT(run("plan run.json --environment /tmp").err, HasSubstr("/tmp is a folder; an "));
  std::ofstream(folder / "square.hdr") << "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 2\n"
                                       << std::string(16, '\x80');
  EXPECT_THAT(run("plan run.json --environment square.hdr").err,
              HasSubstr("is 2 x 2 pixels; a latitude-longitude map is twice as wide"));
  EXPECT_THAT(run("info /tmp").err, HasSubstr("/tmp: is a folder; give a file"));
  EXPECT_THAT(run("plan run.json --wait nan").err, HasSubstr("--wait"));
  EXPECT_THAT(run("plan run.json --environment /dev/null").err,
              HasSubstr("/dev/null is not a regular file; an "));
}

TEST_F(App, ControlCharactersOfFilesDoNotReachTheTerminal) {
  std::ofstream(folder / "odd.json") << R"({"objects": [
  {"name": "\u001b[2Jball", "shape": "sphere", "material": {"base_color": "#fff", "s": 1}}],
  "x\u009b1m": 1})";
  EXPECT_THAT(run("info odd.json").err, HasSubstr("x\\u009b1m"));
  std::ofstream(folder / "odd.json")
      << R"({"objects": [{"name": "\u001b[2Jball", "shape": "sphere", "material": {"s": 1}}]})";
  const Result info = run("info odd.json");
  EXPECT_EQ(info.exitCode, 0) << info.err;
  EXPECT_THAT(info.out, HasSubstr("\\u001b[2Jball"));
  EXPECT_EQ(info.out.find('\x1b'), std::string::npos);
  EXPECT_NO_THROW(config::parseText(run("info odd.json --json").out, "info"));
}

TEST_F(App, ADeviceThatFailsLeavesTheOldRun) {
  ASSERT_EQ(run("render run.json --frames 1-2 --out a").exitCode, 0);
  const auto before = frames("a");
  const Result failed =
      run("render run.json --method traced --device egl:99 --existing overwrite --out a");
  EXPECT_EQ(failed.exitCode, 4) << failed.err;
  EXPECT_EQ(frames("a"), before);
  EXPECT_TRUE(fs::exists(folder / "a/frames.jsonl"));
}

TEST_F(App, FramesTooBrightFailAloneAndTheOtherMethodsGoOn) {
  // Each mirror multiplies: 1e9 * 1e9 * 1e30 is beyond single precision.
  std::ofstream(folder / "scene.json") << R"({"objects": [
  {"name": "ball", "shape": "sphere", "radius": 0.5, "translate": [0, 0.5, 0],
   "material": {"s": 1, "g": 0, "tint": [1e9, 1e9, 1e9]}}],
  "environment": {"type": "constant", "color": [1, 1, 1], "scale": 1e30}})";
  const Result result =
      run("render run.json --frames 1-2 --keep-going --out a --set image.half=false "
          "--set 'methods=[{\"method\":\"reference\",\"name\":\"bright\",\"samples\":1},"
          "{\"method\":\"reference\",\"name\":\"other\",\"samples\":1,\"bounces\":1}]'");
  EXPECT_EQ(result.exitCode, 6) << result.err;
  EXPECT_THAT(result.err, HasSubstr("bright: frame 1: channel R has an infinity at pixel ("));
  EXPECT_THAT(result.err, HasSubstr("bright: frame 2: "));
  EXPECT_THAT(result.err, HasSubstr("other: frame 2: "));
}

TEST_F(App, TooLittleMemoryIsExit8) {
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "AddressSanitizer takes terabytes of address space";
#endif
  std::ofstream(folder / "scene.json") << R"({"objects": [
  {"shape": "plane", "segments": [4096, 1500]}]})";
  const std::string command = "cd '" + folder.string() +
                              "' && ulimit -v 500000 && " CATOPTRIC_PROGRAM
                              " info scene.json >stdout.txt 2>stderr.txt";
  const int status = std::system(command.c_str());
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 8) << textOf(folder / "stderr.txt");
  EXPECT_EQ(textOf(folder / "stderr.txt"), "error: out of memory\n");
  EXPECT_THAT(run("--help").out, HasSubstr("8  out of memory"));
}

TEST_F(App, TheCameraThatAFileGivesIsSaid) {
  const auto file = [&](const char* cameras) {
    std::ofstream(folder / "cameras.gltf") << R"({"asset": {"version": "2.0"},
  "buffers": [{"byteLength": 36, "uri": "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}],
  "bufferViews": [{"buffer": 0, "byteLength": 36}],
  "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
  "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
  "cameras": [{"type": "perspective", "perspective": {"yfov": 0.8, "znear": 0.1}}],
  "nodes": [{"mesh": 0})" << cameras << "]}";
  };
  const auto picture = [&](const std::string& name, const std::string& camera) {
    const Result result =
        run("render cameras.gltf --method reference --set image.width=32 --set "
            "image.height=24 --out " +
            name + camera);
    EXPECT_EQ(result.exitCode, 0) << result.err;
    return result.err;
  };
  const char* const kHigh = R"(, {"name": "high", "camera": 0, "translation": [0.3, 0.3, 2]})";
  file("");
  EXPECT_THAT(picture("none", ""), Not(HasSubstr("its camera")));
  file(kHigh);
  EXPECT_THAT(picture("one", ""), HasSubstr("cameras.gltf: its camera \"high\" is used; --camera "
                                            "front, three_quarter or turntable:48 shows the"));
  file(
      (std::string(kHigh) + R"(, {"name": "low", "camera": 0, "translation": [1, 0, 3]})").c_str());
  EXPECT_THAT(
      picture("several", ""),
      HasSubstr("its camera \"high\", the first of 2, is used; --camera NAME uses another"));
  EXPECT_THAT(picture("chosen", " --camera high"), Not(HasSubstr("its camera")));
  EXPECT_EQ(frames("several"), frames("chosen"));
  EXPECT_NE(frames("several"), frames("none"));
}

TEST_F(App, SubmittedTasksReadTheShadersOfTheFolder) {
  const fs::path file = folder / "src/methods/environment_map/shaders/lookup.frag";
  fs::create_directories(file.parent_path());
  ASSERT_EQ(
      run("submit run.json --method environment_map --frames 1 --chunks 1 --to script --out s "
          "--shader-dir src")
          .exitCode,
      0);
  std::ofstream(file) << "no shader\n";
  EXPECT_NE(std::system(("'" + (folder / "s/chunk.sh").string() + "' 1").c_str()), 0);
  EXPECT_THAT(textOf(folder / "s/logs/1.log"), HasSubstr("lookup.frag"));
}

TEST_F(App, FramesSayWhereTheyComeFrom) {
  ASSERT_EQ(
      run("render run.json --frames 3 --seed 7 --out a --set methods.reference.name=fine").exitCode,
      0);
  const std::string exr = frames("a").begin()->second;
  for (const char* attribute :
       {"catoptric.version", "catoptric.seed", "catoptric.samplesPerAxis", "catoptric.method",
        "catoptric.name", "catoptric.options", "catoptric.scene", "catoptric.frame"})
    EXPECT_NE(exr.find(attribute), std::string::npos) << attribute;
  const std::size_t name = exr.find("catoptric.name");
  EXPECT_NE(exr.substr(name, 40).find("fine"), std::string::npos);
  const std::size_t seed = exr.find("catoptric.seed");
  EXPECT_NE(exr.substr(seed, 40).find('7'), std::string::npos);
}

}  // namespace
}  // namespace catoptric::app
