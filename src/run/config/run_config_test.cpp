#include "run/config/run_config.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <set>

#include "core/error.h"

namespace catoptric::run {
namespace {

const config::Schema& fakeOptions() {
  static const config::Schema schema{"fake",
                                     "",
                                     {{.name = "bvh",
                                       .type = config::FieldType::String,
                                       .help = "Policy.",
                                       .defaultText = "\"static\"",
                                       .allowed = {"static", "refit"}}}};
  return schema;
}

std::vector<methods::MethodEntry> registry() {
  return {{"traced", "Rays.", "", {}, {}, {}, {}, {}, fakeOptions(), nullptr},
          {.id = "reference",
           .summary = "Truth.",
           .paper = "",
           .steps = {},
           .options = fakeOptions(),
           .make = nullptr,
           .aliases = {{"refitted", "bvh", "\"refit\""}}}};
}

RunConfig read(const std::string& text, const std::vector<std::string>& methods = {}) {
  return readRunConfig(config::parseText(text, "configs/f.json"), "configs/f.json", registry(),
                       methods);
}

std::string messageOf(const std::string& text, const std::vector<std::string>& methods = {}) {
  try {
    read(text, methods);
  } catch (const UsageError& error) {
    return error.what();
  }
  return "(no error)";
}

TEST(RunConfig, DefaultsAreComplete) {
  const RunConfig run = read("{\"scene\": \"../scenes/a.json\"}");
  EXPECT_EQ(run.name, "f");
  EXPECT_EQ(run.scene, "scenes/a.json");
  EXPECT_TRUE(run.path.empty());
  EXPECT_EQ(run.image.width, 512);
  EXPECT_EQ(run.image.samples, 2);
  ASSERT_EQ(run.methods.size(), 1u);
  EXPECT_EQ(run.methods[0].id, "traced");
  EXPECT_EQ(run.methods[0].effective, "{\"bvh\":\"static\"}");
  EXPECT_THAT(run.effective, testing::HasSubstr("\"width\":512"));
  EXPECT_THAT(read("{\"scene\": \"a\", \"missing_textures\": \"show\"}").effective,
              testing::HasSubstr("\"missing_textures\":\"show\""));
}

TEST(RunConfig, MethodsHaveNamesAndOptions) {
  const RunConfig run = read(
      "{\"scene\": \"a\", \"methods\": [\"reference\", {\"method\": \"traced\", \"name\": "
      "\"refitted\", "
      "\"bvh\": \"refit\"}, \"traced\"], \"errors\": {\"against\": [\"reference\"]}}");
  ASSERT_EQ(run.methods.size(), 3u);
  EXPECT_EQ(run.methods[1].name, "refitted");
  EXPECT_EQ(run.methods[1].id, "traced");
  EXPECT_EQ(run.methods[1].effective, "{\"bvh\":\"refit\"}");
  EXPECT_EQ(run.methods[1].options.keys(), std::vector<std::string>{"bvh"});  // what it understands
  EXPECT_THAT(run.errorsAgainst, testing::ElementsAre("reference"));
}

TEST(RunConfig, AliasesAreMethodsWithAnOption) {
  const std::string text =
      R"({"scene": "a", "methods": ["refitted", {"method": "refitted", "name": "own"}]})";
  const RunConfig run = read(text);
  ASSERT_EQ(run.methods.size(), 2u);
  for (const MethodConfig& method : run.methods) {
    EXPECT_EQ(method.id, "reference");
    EXPECT_EQ(method.effective, "{\"bvh\":\"refit\"}");
  }
  EXPECT_EQ(run.methods[0].name, "refitted");
  EXPECT_EQ(run.methods[1].name, "own");
  EXPECT_EQ(read(R"({"scene": "a"})", {"refitted"}).methods[0].effective, run.methods[0].effective);
}

TEST(RunConfig, AllErrorsAtOnceWithPlaces) {
  EXPECT_EQ(
      messageOf("{\"scene\": \"a\",\n\"frame\": \"1\",\n\"image\": {\"samples\": 9},\n\"methods\": "
                "[\"tracd\",\n{\"method\": \"traced\", \"bvh\": \"refitt\"}, {\"bvh\": 1}]}"),
      "configs/f.json:2: /frame: unknown name \"frame\" (did you mean \"frames\"?); allowed: "
      "$schema, comment, scene, path, camera, environment, ground, missing_textures, asset_paths, "
      "frames, image, methods, errors, "
      "preview, sweep, "
      "seed, "
      "device, "
      "threads\n"
      "configs/f.json:3: /image/samples: 9 is out of range; allowed: 1 to 8\n"
      "configs/f.json:4: /methods/0: \"tracd\" is not a method (did you mean \"traced\"?); "
      "allowed: traced, reference, refitted\n"
      "configs/f.json:5: /methods/1/bvh: \"refitt\" is not allowed (did you mean \"refit\"?); "
      "allowed: static, refit\n"
      "configs/f.json:5: /methods/2: \"method\" is missing; expected one of: traced, "
      "reference, refitted");
  EXPECT_EQ(messageOf("{\"scene\": \"a\", \"methods\": [\"traced\", \"traced\"]}"),
            "configs/f.json:1: /methods/1: two methods are called \"traced\"; give one of them "
            "another \"name\"");
  EXPECT_EQ(messageOf("{\"scene\": \"a\", \"errors\": {\"against\": [\"refrence\"]}}"),
            "configs/f.json:1: /errors/against/0: \"refrence\" is not one of this run's methods; "
            "allowed: traced");
  EXPECT_EQ(
      messageOf("{\"scene\": \"a\", \"methods\": [{\"method\": \"traced\", \"name\": \"../x\"}]}"),
      "configs/f.json:1: /methods/0/name: \"../x\" cannot name a folder; allowed: letters, "
      "digits, _ - .");
  EXPECT_THAT(messageOf(R"({"scene": "a", "path": "b", "camera": "front"})"),
              testing::HasSubstr("/camera: has no effect beside \"path\"; remove one"));
}

TEST(RunConfig, MethodOptionSelectsAndAdds) {
  const std::string text =
      "{\"scene\": \"a\", \"methods\": [{\"method\": \"traced\", \"bvh\": \"refit\"}]}";
  EXPECT_EQ(read(text, {"traced"}).methods[0].effective, "{\"bvh\":\"refit\"}");
  EXPECT_EQ(read(text, {"reference"}).methods[0].effective, "{\"bvh\":\"static\"}");
  EXPECT_EQ(
      messageOf(text, {"refrence"}),
      "--method: \"refrence\" is not a method (did you mean \"reference\"?); allowed: traced, "
      "reference, refitted");
  EXPECT_EQ(messageOf(text, {"traced", "traced"}), "--method: \"traced\" is named twice");
}

TEST(RunConfig, PixelSettingsLeaveOutWhatChangesNoPixel) {
  const auto settings = [](const std::string& members) {
    const std::string text =
        R"({"scene": "a", "methods": [{"method": "perturbation")" + members + "}";
    const RunConfig run = readRunConfig(config::parseText(text, "f"), "f", methods::registry());
    return run.pixelSettings(run.methods[0]);
  };
  EXPECT_EQ(settings(R"(}], "threads": 1, "frames": "1")"), settings(R"(}], "threads": 2)"));
  const std::set<std::string> all = {settings("}]"),
                                     settings(R"(, "error": 2}])"),
                                     settings(R"(, "reflectors": {"a": "traced"}}])"),
                                     settings(R"(, "reflectors": {"b": "traced"}}])"),
                                     settings(R"(, "unsupported": "traced"}])"),
                                     settings(R"(}], "seed": 7)"),
                                     settings(R"(}], "device": "osmesa")"),
                                     settings(R"(}], "image": {"samples": 3})"),
                                     settings(R"(}], "image": {"layers": ["Z"]})"),
                                     settings(R"(}], "preview": {"exposure": 1})"),
                                     settings(R"(}], "preview": {"view": "sRGB"})")};
  EXPECT_EQ(all.size(), 11u);
}

TEST(RunConfig, MethodsCannotTakeTheNamesOfARunsFiles) {
  for (const char* name : {"frames", "previews", "summary.json", "timings.csv", "table.md"})
    EXPECT_THAT(messageOf(std::string("{\"scene\": \"a\", \"methods\": [{\"method\": \"traced\", "
                                      "\"name\": \"") +
                          name + "\"}]}"),
                testing::HasSubstr("is the name of a run's own file"))
        << name;
}

TEST(RunConfig, ListsThatAreGivenAsOneItemAreShownAsTheyAreWritten) {
  EXPECT_EQ(messageOf("{\"scene\": \"a\", \"image\": {\"layers\": \"Z\"}}"),
            "configs/f.json:1: /image/layers: \"Z\" is not an array; did you mean [\"Z\"]?");
  const config::Value set =
      config::withSetting(config::parseText("{\"scene\": \"a\"}", "f"), "errors.against", "traced");
  try {
    readRunConfig(set, "f", registry());
    FAIL();
  } catch (const UsageError& error) {
    EXPECT_STREQ(
        error.what(),
        "--set errors.against=traced: /errors/against: \"traced\" is not an array; did you "
        "mean --set 'errors.against=[\"traced\"]'?");
  }
}

TEST(RunConfig, FilesKnowWhereTheyAreNamed) {
  const RunConfig run = read("{\n\"scene\": \"a.json\",\n\"path\": \"p.json\"}");
  EXPECT_EQ(run.sceneReference, "configs/f.json:2: /scene");
  EXPECT_EQ(run.pathReference, "configs/f.json:3: /path");
}

TEST(RunConfig, EnvironmentsAreNamed) {
  EXPECT_FALSE(read("{\"scene\": \"a\"}").environment);
  EXPECT_EQ(read("{\"scene\": \"a\", \"environment\": \"#ffffff\"}").environment.value().color,
            Vec3(1.0f));
  EXPECT_THAT(messageOf("{\"scene\": \"a\", \"environment\": \"none.exr\"}"),
              testing::HasSubstr("configs/f.json:1: /environment: there is no file "
                                 "configs/none.exr"));
}

TEST(RunConfig, FilesAreKnownByTheirNames) {
  const auto kind = [](const char* text) { return fileKind(config::parseText(text, "t")); };
  EXPECT_EQ(kind(R"({"scene": "a.json", "frames": "1"})"), FileKind::RunConfig);
  EXPECT_EQ(kind(R"({"objects": []})"), FileKind::Scene);
  EXPECT_EQ(kind(R"({"frames": 6, "orbit": {"radius": 3}})"), FileKind::Path);
  EXPECT_EQ(kind(R"({"frames": "1-3"})"), FileKind::Unknown);  // a config without its scene
  EXPECT_EQ(kind("[]"), FileKind::Unknown);
}

TEST(RunConfig, BareScenesNeedNoConfig) {
  EXPECT_TRUE(isScene("x/room.GLB"));
  const config::Value value = configOfScene("x/room.glb", {"traced"});
  EXPECT_EQ(readRunConfig(value, "x/room.glb", registry()).scene, "x/room.glb");
  const std::string folder = testing::TempDir();
  std::ofstream(folder + "scene.json") << "{\"objects\": []}";
  std::ofstream(folder + "config.json") << "{\"scene\": \"scene.json\"}";
  EXPECT_TRUE(isScene(folder + "scene.json"));
  EXPECT_FALSE(isScene(folder + "config.json"));
}

}  // namespace
}  // namespace catoptric::run
