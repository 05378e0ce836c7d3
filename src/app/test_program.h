// Runs the program in a folder of the test, with a scene, a path and a run config.
#pragma once

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>

namespace catoptric::app {
namespace fs = std::filesystem;

struct Result {
  int exitCode = -1;
  std::string out;
  std::string err;
};

inline std::string textOf(const fs::path& file) {
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

inline fs::path freshFolder() {
  const auto* info = testing::UnitTest::GetInstance()->current_test_info();
  fs::path path = fs::path(testing::TempDir()) /
                  ("app_" + std::string(info->name()) + "_" + std::to_string(::getpid()));
  fs::remove_all(path);
  fs::create_directories(path);
  return path;
}

class App : public testing::Test {
 protected:
  App() : folder(freshFolder()) {
    std::ofstream(folder / "scene.json") << R"({"objects": [
  {"name": "floor", "shape": "plane", "size": [4, 4], "material": {"base_color": [0.6, 0.5, 0.4]}},
  {"name": "ball", "shape": "sphere", "radius": 0.5, "translate": [0, 0.5, 0],
   "material": {"base_color": [0.9, 0.9, 0.9], "s": 0.9, "g": 0}}],
  "environment": {"type": "gradient", "zenith": [0.2, 0.4, 0.9], "horizon": [1, 1, 1],
                  "ground": [0.2, 0.2, 0.2]}})";
    std::ofstream(folder / "path.json")
        << R"({"frames": 6, "orbit": {"center": [0, 0.5, 0], "radius": 3, "height": 0.8}})";
    std::ofstream(folder / "run.json") << R"({
  "scene": "scene.json", "path": "path.json",
  "image": {"width": 32, "height": 24, "layers": ["s", "Z"]},
  "methods": [{"method": "reference", "max_standard_error": 0, "samples": 2, "rays": 1}]
})";
  }
  ~App() override { fs::remove_all(folder); }

  Result run(const std::string& arguments) const {
    const std::string command = "cd '" + folder.string() + "' && XDG_CACHE_HOME='" +
                                (folder / "cache").string() + "' " CATOPTRIC_PROGRAM " " +
                                arguments + " >stdout.txt 2>stderr.txt";
    const int status = std::system(command.c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, textOf(folder / "stdout.txt"),
            textOf(folder / "stderr.txt")};
  }
  std::map<std::string, std::string> frames(const std::string& run) const {
    std::map<std::string, std::string> files;
    for (const auto& entry : fs::directory_iterator(folder / run / "frames"))
      files[entry.path().filename().string()] = textOf(entry.path());
    return files;
  }

  fs::path folder;
};

/// With a reference to compare with.
class Study : public App {
 protected:
  Study() {
    std::ofstream(folder / "run.json") << R"({
  "scene": "scene.json", "path": "path.json", "frames": "1-3",
  "image": {"width": 32, "height": 24, "layers": ["s"]},
  "methods": [{"method": "reference", "max_standard_error": 0, "samples": 1, "rays": 1},
              {"method": "reference", "max_standard_error": 0, "name": "truth", "samples": 4, "rays": 1}],
  "errors": {"against": ["truth"]}
})";
  }
};

}  // namespace catoptric::app
