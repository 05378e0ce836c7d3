// The keys of settings: what was measured of one setting is never taken for that of another.
#include "study/bench.h"

#include <gtest/gtest.h>

#include <fstream>
#include <set>

#include "core/error.h"

namespace catoptric::study {
namespace {

class Keys : public testing::Test {
 protected:
  Keys() : folder_(std::filesystem::path(testing::TempDir()) / "study_keys") {
    std::filesystem::create_directories(folder_);
    write("scene.json", R"({"objects": [{"name": "ball", "shape": "sphere", "radius": 0.5,
                            "material": {"base_color": [0.9, 0.9, 0.9], "s": 0.9, "g": 0}}]})");
    write("path.json", R"({"frames": 2, "orbit": {"center": [0, 0, 0], "radius": 3}})");
    write("program", "of today");
    point_.method = "traced";
    point_.program = folder_ / "program";
  }
  ~Keys() override { std::filesystem::remove_all(folder_); }

  void write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
  }
  std::string key() const {
    const std::string config = R"({"scene": "scene.json", )" + view_ + R"(, "methods": [
        {"method": "traced"}, {"method": "traced", "name": "twin"}])" +
                               members_ + "}";
    const auto readRun = [&](const Settings&, const std::string& method) {
      return run::readRunConfig(config::parseText(config, "run.json"), folder_ / "run.json",
                                methods::registry(), {method});
    };
    return Bench({readRun, {}}, options_).prepare(point_).key;
  }

  std::filesystem::path folder_;
  std::string members_;
  std::string view_ = R"("path": "path.json")";
  Point point_;
  BenchOptions options_;
};

TEST_F(Keys, DependOnAllThatTimesAndErrorsDependOn) {
  std::set<std::string> keys = {key()};
  EXPECT_EQ(key(), *keys.begin());
  const auto expectAnother = [&](const char* than) {
    EXPECT_TRUE(keys.insert(key()).second) << than;
  };
  members_ = R"(, "threads": 1)";
  expectAnother("number of threads");
  members_ = R"(, "image": {"width": 32})";
  expectAnother("image");
  members_ = R"(, "environment": "0.5,0.5,0.5")";
  expectAnother("environment");
  options_.processor = "another";
  expectAnother("processor");
  options_.shaders = "given";
  expectAnother("shaders of a folder");
  point_.method = "twin";
  expectAnother("name of the same options");
  write("program", "of yesterday");
  expectAnother("program");
  write("path.json", R"({"frames": 2, "orbit": {"center": [0, 0, 0], "radius": 4}})");
  expectAnother("path");
  for (const char* camera : {"front", "three_quarter"}) {
    view_ = R"("camera": ")" + std::string(camera) + "\"";
    expectAnother(camera);
  }
  write("scene.json", R"({"objects": [{"name": "ball", "shape": "sphere", "radius": 0.6,
                          "material": {"base_color": [0.9, 0.9, 0.9], "s": 0.9, "g": 0}}]})");
  expectAnother("scene");
}

TEST(SamplesFile, ReadsBackTheSameAndThoseOfOlderBuilds) {
  Samples written;
  written.keys = {"a", "b"};
  for (const std::size_t setting : {0u, 1u}) {
    Turn turn{1, 2, setting, 3, {}};
    turn.report.seconds = 0.25;
    turn.report.cpuSeconds = 0.5;
    turn.report.steps = {{"gbuffer", 0.125}, {"trace", 0.0625}};
    turn.report.memoryBytes = 1000 + setting;
    written.measurement.turns.push_back(turn);
    turn.frame = kFirst;
    turn.report.steps.clear();
    turn.report.memoryBytes = 3000;
    if (setting == 1) written.measurement.turns.push_back(turn);
  }
  const std::string text = samplesCsv(written);
  const Samples read = parseSamples(text, "samples");
  EXPECT_EQ(samplesCsv(read), text);
  EXPECT_EQ(read.keys, written.keys);
  EXPECT_EQ(read.frames, std::vector<int>{3});
  EXPECT_EQ(read.measurement.memoryBytes(0), 1000u);
  EXPECT_EQ(read.measurement.memoryBytes(1), 3000u);

  const Samples older = parseSamples(
      "round,turn,point,frame,seconds,cpu_seconds,steps\n1,1,a,3,0.5,0.5,gbuffer=0.1\n", "older");
  EXPECT_EQ(older.measurement.turns.at(0).report.steps.at("gbuffer"), 0.1);
  EXPECT_EQ(older.measurement.memoryBytes(0), 0u);
  EXPECT_THROW(parseSamples("frame,seconds\n", "other"), UsageError);
}

}  // namespace
}  // namespace catoptric::study
