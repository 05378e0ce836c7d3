// All methods of a run config through the program, on the device of CATOPTRIC_DEVICE.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "config/json.h"

namespace catoptric::app {
namespace {

namespace fs = std::filesystem;

std::string textOf(const fs::path& file) {
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

int run(const fs::path& folder, const std::string& arguments) {
  const char* device = std::getenv("CATOPTRIC_DEVICE");
  const std::string command = "cd '" CATOPTRIC_SOURCE_DIR "' && XDG_CACHE_HOME='" +
                              (folder / "cache").string() + "' " CATOPTRIC_PROGRAM " " + arguments +
                              " --device " + (device != nullptr ? device : "auto") + " >'" +
                              (folder / "out.txt").string() + "' 2>'" +
                              (folder / "err.txt").string() + "'";
  const int status = std::system(command.c_str());
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

TEST(AppGl, CornellBoxByAllMethods) {
  const fs::path folder = fs::path(testing::TempDir()) / ("app_gl_" + std::to_string(::getpid()));
  fs::create_directories(folder);
  const std::string small =
      "render configs/cornell_box.json --set image.width=96 --set image.height=96 --frames 1,3 ";
  ASSERT_EQ(run(folder, small + "--out '" + (folder / "a").string() + "' --json"), 0)
      << textOf(folder / "err.txt");
  const config::Value result = config::parseText(textOf(folder / "out.txt"), "out");
  ASSERT_EQ(result.get("methods").asArray().size(), 4u);
  for (const config::Value& method : result.get("methods").asArray())
    EXPECT_EQ(method.get("rendered").dump(), "[1,3]");

  // The traced method is near the truth; a cube map is not, where mirrors are near walls.
  std::map<std::string, double> errors;
  EXPECT_EQ(result.get("errors").asArray().size(), 5u);  // no pair twice
  for (const config::Value& error : result.get("errors").asArray()) {
    if (error.get("against").asString() != "reference") continue;
    errors[error.get("method").asString()] = error.get("pooled").get("L1_8bit").asNumber();
  }
  ASSERT_EQ(errors.size(), 3u);
  EXPECT_LT(errors["traced"], 1.5);
  EXPECT_LT(errors["second_order"], errors["traced"] + 2.0);
  EXPECT_GT(errors["environment_map"], 2.0 * errors["traced"]);
  EXPECT_GT(errors["environment_map"], errors["second_order"]);

  // Steps that nothing names are a small part; the plan's steps are those that were measured.
  const config::Value summary = config::parseFile(folder / "a/traced/summary.json");
  for (const char* step : {"gbuffer", "trace", "composite", "readback", "encode", "write"})
    EXPECT_TRUE(summary.get("steps").has(step)) << step;
  EXPECT_NE(summary.get("device").get("renderer").asString(), "CPU");
  fs::remove_all(folder);
}

TEST(AppGl, WeakAttenuationTendsToNoneAndACameraInsideAMirrorIsTold) {
  const fs::path folder =
      fs::path(testing::TempDir()) / ("app_gl_weak_" + std::to_string(::getpid()));
  fs::create_directories(folder);
  std::ofstream(folder / "path.json") << R"({"frames": 2, "keyframes": [
    {"position": [0, 0.6, 3], "target": [0, 0.5, 0]},
    {"position": [0, 0.6, 0.1], "target": [0, 0.5, 3]}]})";
  std::ofstream(folder / "scene.json") << R"({"objects": [
    {"name": "floor", "shape": "plane", "size": [4, 4]},
    {"name": "ball", "shape": "sphere", "radius": 0.5, "translate": [0, 0.5, 0],
     "material": {"s": 0.9, "g": 0}, "reflective": true}],
    "environment": {"type": "constant", "color": [0.5, 0.6, 0.7]}})";
  const std::string methods[] = {"traced", "billboards", "depth_impostors"};
  std::string text;
  for (const std::string& method : methods)
    for (const char* weak : {"0", "1e30"})
      text += std::string(text.empty() ? "" : ", ") + R"({"method": ")" + method +
              R"(", "name": ")" + method + "_" + weak + R"(", "attenuation": )" + weak + "}";
  std::ofstream(folder / "run.json")
      << R"({"scene": "scene.json", "path": "path.json", "frames": "1",
    "image": {"width": 32, "height": 24}, "methods": [)" +
             text + "]}";
  const std::string render = "render '" + (folder / "run.json").string() + "' ";
  const std::string out = "--out '" + (folder / "out").string() + "' ";
  ASSERT_EQ(run(folder, render + out), 0) << textOf(folder / "err.txt");
  EXPECT_THAT(textOf(folder / "err.txt"), testing::Not(testing::HasSubstr("is inside")));
  for (const std::string& method : methods) {
    const auto frame = [&](const std::string& weak) {
      return textOf(folder / "out" / (method + "_" + weak) / "previews/frame.0001.png");
    };
    EXPECT_TRUE(frame("0") == frame("1e30")) << method;
  }
  EXPECT_EQ(run(folder, render + out + "--existing overwrite --method traced_0 --frames 2"), 2);
  EXPECT_EQ(run(folder, render + "--method traced_0 --frames 2 --out '" +
                            (folder / "inside").string() + "'"),
            0);
  EXPECT_THAT(textOf(folder / "err.txt"),
              testing::HasSubstr("frame 2: the camera is inside the reflective object \"ball\""));
  fs::remove_all(folder);
}

TEST(AppGl, AMethodThatFailsLeavesTheOthersTheirTables) {
  const fs::path folder =
      fs::path(testing::TempDir()) / ("app_gl_fails_" + std::to_string(::getpid()));
  fs::create_directories(folder);
  std::ofstream(folder / "run.json") << R"({
    "scene": ")" CATOPTRIC_SOURCE_DIR R"(/scenes/nine_spheres.json",
    "image": {"width": 512, "height": 512, "samples": 3},
    "methods": [{"method": "second_order", "probes": 0, "memory_mib": 1, "depth_image_scale": 8,
                 "bin_density": 1000, "max_theta_bins": 128, "max_phi_bins": 64},
                "traced", "environment_map"],
    "errors": {"against": ["second_order", "traced"]}})";
  EXPECT_EQ(run(folder, "render '" + (folder / "run.json").string() + "' --frames 1 --out '" +
                            (folder / "out").string() + "'"),
            8);
  const std::string tables = textOf(folder / "out.txt");
  for (const std::string& text :
       {tables, textOf(folder / "out/table.md"), textOf(folder / "out/errors.md")}) {
    EXPECT_THAT(text, testing::HasSubstr("environment_map"));
    EXPECT_THAT(text, testing::HasSubstr("FAILED: second_order, frame 1: "));
    EXPECT_THAT(text, testing::HasSubstr("memory_mib"));
  }
  EXPECT_TRUE(fs::exists(folder / "out/contact_sheet.png"));
  EXPECT_TRUE(fs::exists(folder / "out/traced/frames/frame.0001.exr"));
  fs::remove_all(folder);
}

}  // namespace
}  // namespace catoptric::app
