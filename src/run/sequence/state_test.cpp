// Methods with state: pixels depend on the path alone, never on which frames are asked for, on
// chunks, on resumed runs or on threads. The state is a hash chain over all frames since the
// restart frame, so that a frame too few or too many gives another pixel.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/file.h"
#include "core/test_fields.h"
#include "methods/contract/restarts.h"
#include "run/sequence/sequence.h"
#include "run/sequence/tasks.h"
#include "run/test_folders.h"

namespace catoptric::run {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

/// A camera that moves evenly and jumps at frame 33.
class TestPath : public scene::CameraPath {
 public:
  explicit TestPath(int count) : count_(count) {}
  int count() const override { return count_; }
  scene::PathFrame frame(int number) const override {
    scene::PathFrame frame;
    frame.number = number;
    frame.timeSeconds = 0.04 * number;
    frame.camera.worldFromCamera[3].x = 0.1f * static_cast<float>(number) + (number < 33 ? 0 : 50);
    return frame;
  }

 private:
  int count_;
};

constexpr int kEvery = 20;

/// Restarts every 20 frames and where the camera jumps.
class TestMethod : public methods::Method {
 public:
  methods::MethodPlan plan(const scene::Scene&, const methods::RunSettings&) const override {
    return {};
  }
  void render(const methods::FrameInput&, methods::Services&, methods::FrameOutput&) override {}
  bool restartsAt(const scene::CameraPath& path, int number) const override {
    return methods::onRestartGrid(number, kEvery) || methods::cutsBefore(path, number);
  }
};

/// A frame is one pixel: the hash of all cameras since the restart frame.
class ChainSource : public FrameSource {
 public:
  std::vector<frame::StepSample> prepare() override { return {}; }
  RenderedFrame render(const FrameRequest& request) override {
    const int number = request.frame.number;
    calls.push_back(number);
    EXPECT_TRUE(request.restarts || last_ + 1 == number) << "no frame before " << number;
    EXPECT_TRUE(request.restarts || !request.firstOfSequence) << number;
    if (request.restarts) chain_ = 14695981039346656037ull;
    last_ = number;
    if (failing.contains(number)) throw SceneError("no state");
    chain_ = (chain_ ^ static_cast<std::uint64_t>(number)) * 1099511628211ull;
    if (request.kept && failingToDraw.contains(number)) throw SceneError("no picture");
    RenderedFrame rendered;
    rendered.image = {1, 1, {"R"}, {static_cast<float>(chain_ % 16777213u)}};
    return rendered;
  }

  std::vector<int> calls;
  std::set<int> failing;        ///< in any case
  std::set<int> failingToDraw;  ///< where they are kept

 private:
  std::uint64_t chain_ = 0;
  int last_ = -1;
};

SequenceOptions stateOptions(Existing existing = Existing::Error, int writers = 2) {
  SequenceOptions o;
  o.existing = existing;
  o.writerThreads = writers;
  o.encode = [](RenderedFrame& frame, const scene::PathFrame& path) {
    std::vector<std::byte> bytes(sizeof(float));
    std::memcpy(bytes.data(), frame.image.data.data(), sizeof(float));
    return std::vector<EncodedFile>{
        {framePath("frames", path.number, ".exr"), bytes, "encode", 0.0}};
  };
  return o;
}

class State : public testing::Test {
 protected:
  State() : folder_(fs::path(testing::TempDir()) / "State") {
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    folder_ += std::string("_") + info->name();
    fs::remove_all(folder_);
    ChainSource source;
    EXPECT_TRUE(run(source, "whole", "1-60", stateOptions()).missing.empty());
    whole_ = filesOf(folder_ / "whole");
    EXPECT_EQ(whole_.size(), 60u);
  }

  std::vector<FrameTask> tasksOf(const std::string& frames) const {
    return makeTasks(path_, scene::parseFrames(frames, path_.count()), method_,
                     {"c", "s", "", "b"});
  }
  SequenceResult run(ChainSource& source, const std::string& name, const std::string& frames,
                     const SequenceOptions& how) {
    return runSequence(source, tasksOf(frames), folder_ / name, how);
  }
  /// Every frame that is there is the whole run's.
  void expectWhole(const std::string& name, std::size_t count) {
    const auto files = filesOf(folder_ / name);
    EXPECT_EQ(files.size(), count) << name;
    for (const auto& [file, bytes] : files) EXPECT_EQ(bytes, whole_.at(file)) << name << file;
  }

  TestPath path_{60};
  TestMethod method_;
  fs::path folder_;
  std::map<std::string, std::string> whole_;
};

TEST(Tasks, EveryPartOfACameraIsInItsFingerprint) {
  /// A path of one frame, which stands still.
  struct OneFrame : scene::CameraPath {
    scene::PathFrame only;
    int count() const override { return 1; }
    scene::PathFrame frame(int) const override { return only; }
  };
  OneFrame path;
  const auto print = [&path] {
    return makeTasks(path, {1}, TestMethod(), {"c", "s", "", "b"}).at(0).fingerprints.camera;
  };
  auto& [number, timeSeconds, camera] = path.only;
  auto& [worldFromCamera, verticalFovRad, nearMetres] = camera;
  test::expectAllCount(print, timeSeconds, worldFromCamera, verticalFovRad, nearMetres);
  test::expectNoneCounts(print, number);
}

TEST(Tasks, OfEarlierFramesThoseSinceTheRestartCount) {
  const auto print = [](const std::vector<int>& asked) {
    const std::vector<FrameTask> tasks =
        makeTasks(TestPath(60), asked, TestMethod(), {"c", "s", "", "b"});
    const auto task =
        std::ranges::find_if(tasks, [](const FrameTask& t) { return t.frame.number == 45; });
    return task->fingerprints.camera;
  };
  // A restart is at 41: whatever is asked for before, the frame is the same
  EXPECT_EQ(print({45}), print({5, 45}));
  EXPECT_EQ(print({45}), print({40, 43, 45, 46}));
}

TEST_F(State, RestartFramesAreTheGridAndTheCuts) {
  std::vector<int> restarts;
  for (int number = 1; number <= path_.count(); ++number)
    if (method_.restartsAt(path_, number)) restarts.push_back(number);
  EXPECT_THAT(restarts, ElementsAre(1, 21, 33, 41));
}

TEST_F(State, PixelsDoNotDependOnTheFramesAskedFor) {
  // Restart frames, what is asked for, how many frames must be rendered for it
  for (const auto& [frames, asked, rendered] : {std::tuple("50-60", 11u, 20u),
                                                {"1-60x10", 6u, 33u},
                                                {"40", 1u, 8u},
                                                {"41", 1u, 1u},
                                                {"20,21,32,33", 4u, 33u}}) {
    ChainSource source;
    EXPECT_TRUE(run(source, frames, frames, stateOptions()).missing.empty()) << frames;
    expectWhole(frames, asked);
    EXPECT_EQ(source.calls.size(), rendered) << frames;
  }
}

TEST_F(State, PixelsDoNotDependOnWriters) {
  ChainSource source;
  run(source, "one", "1-60", stateOptions(Existing::Error, 1));
  expectWhole("one", 60);
}

TEST_F(State, ChunksInAnyOrderGiveTheWhole) {
  // From the restart frames 1, 21, 33 and 41 that are nearest to 1, 16, 31 and 46
  const std::map<int, std::size_t> sizes = {{1, 20}, {2, 12}, {3, 8}, {4, 20}};
  for (const int index : {3, 1, 4, 2}) {
    ChainSource source;
    SequenceOptions o = stateOptions();
    o.chunk = {index, 4};
    const std::string name = "part" + std::to_string(index);
    EXPECT_EQ(run(source, name, "1-60", o).rendered.size(), sizes.at(index));
    EXPECT_EQ(source.calls.size(), sizes.at(index)) << "frames of another chunk were rendered";
    expectWhole(name, sizes.at(index));
  }
}

TEST_F(State, ManyChunksAreEmptyRatherThanWarmingUp) {
  std::size_t rendered = 0;
  for (int index = 1; index <= 60; ++index) {
    ChainSource source;
    SequenceOptions o = stateOptions();
    o.chunk = {index, 60};
    run(source, "one" + std::to_string(index), "1-60", o);
    rendered += source.calls.size();
  }
  EXPECT_EQ(rendered, 60u);
}

TEST_F(State, AKilledRunGoesOn) {
  ChainSource first;
  SequenceOptions o = stateOptions();
  o.stopRequested = [&] { return first.calls.size() == 27; };
  EXPECT_TRUE(run(first, "killed", "1-60", o).stopped);
  expectWhole("killed", 27);
  ChainSource second;
  const SequenceResult result = run(second, "killed", "1-60", stateOptions(Existing::Resume));
  EXPECT_EQ(second.calls.front(), 21);   // its restart frame
  EXPECT_EQ(result.reused.size(), 27u);  // with those rendered again for their state alone
  EXPECT_EQ(result.rendered.size(), 33u);
  EXPECT_THAT(result.missing, IsEmpty());
  expectWhole("killed", 60);
}

TEST_F(State, ALostFrameIsMadeAnewAndItsHistoryIsReused) {
  fs::remove(folder_ / "whole/frames/frame.0047.exr");
  const SequenceForecast forecast =
      forecastSequence(tasksOf("1-60"), folder_ / "whole", stateOptions(Existing::Resume));
  EXPECT_THAT(forecast.rendered, ElementsAre(47));
  EXPECT_THAT(forecast.warmedUp, ElementsAre(41, 42, 43, 44, 45, 46));
  EXPECT_EQ(forecast.reused.size(), 59u);
  ChainSource source;
  const SequenceResult result = run(source, "whole", "1-60", stateOptions(Existing::Resume));
  EXPECT_THAT(source.calls, ElementsAre(41, 42, 43, 44, 45, 46, 47));
  EXPECT_THAT(result.rendered, ElementsAre(47));
  EXPECT_EQ(result.reused.size(), 59u);
  expectWhole("whole", 60);
}

TEST_F(State, AFrameIsTrustedOnlyWithItsWholeHistory) {
  // Frames 42, 44, ... of a run that was asked for these alone are those of the whole run
  ChainSource source;
  run(source, "even", "42-60x2", stateOptions());
  ChainSource again;
  SequenceOptions resume = stateOptions(Existing::Resume);
  EXPECT_EQ(run(again, "even", "41-60", resume).reused.size(), 10u);
  expectWhole("even", 20);
  // A camera that moved before them, in a frame that was not asked for, makes them others
  std::vector<FrameTask> moved = tasksOf("42-60x2");
  class MovedPath : public TestPath {
   public:
    using TestPath::TestPath;
    scene::PathFrame frame(int number) const override {
      scene::PathFrame frame = TestPath::frame(number);
      if (number == 45) frame.camera.worldFromCamera[3].y = 0.01f;
      return frame;
    }
  };
  const std::vector<FrameTask> other =
      makeTasks(MovedPath(60), scene::parseFrames("42-60x2", 60), method_, {"c", "s", "", "b"});
  ASSERT_EQ(moved.size(), other.size());
  std::vector<int> different;
  for (std::size_t i = 0; i < moved.size(); ++i)
    if (moved[i].fingerprints.camera != other[i].fingerprints.camera)
      different.push_back(moved[i].frame.number);
  EXPECT_EQ(different.front(), 45);
  EXPECT_EQ(different.size(), 16u);
}

TEST_F(State, WhatFailedIsWarmedUpAgainForTheFramesBehindIt) {
  ChainSource source;
  source.failingToDraw = {45};
  SequenceOptions o = stateOptions();
  o.keepGoing = true;
  const SequenceResult result = run(source, "drawn", "41-50", o);
  EXPECT_THAT(result.missing, ElementsAre(45));
  EXPECT_THAT(source.calls,
              ElementsAre(41, 42, 43, 44, 45, 41, 42, 43, 44, 45, 46, 47, 48, 49, 50));
  expectWhole("drawn", 9);
}

TEST_F(State, AStateThatCannotBeHadFailsItsFrames) {
  ChainSource source;
  source.failing = {45};
  SequenceOptions o = stateOptions();
  o.keepGoing = true;
  const SequenceResult result = run(source, "kept", "43-44,46-47,53-60,1-3", o);
  // Frame 45 is only needed by others: it is not in the list itself
  EXPECT_THAT(result.missing, ElementsAre(46, 47, 53, 54, 55, 56, 57, 58, 59, 60));
  ASSERT_EQ(result.failed.size(), 10u);
  EXPECT_THAT(result.failed[0].message, HasSubstr("it needs frame 45 before it"));
  EXPECT_THAT(result.failed[0].message, HasSubstr("no state"));
  expectWhole("kept", 5);

  ChainSource stopping;
  stopping.failing = {45};
  const SequenceResult first = run(stopping, "first", "43-47", stateOptions());
  ASSERT_EQ(first.failed.size(), 1u);
  EXPECT_EQ(first.failed[0].frame, 45);
  EXPECT_THAT(first.missing, ElementsAre(45, 46, 47));

  // A state that fails between frames that are re-used is reported by the one that needs it
  ChainSource warming;
  warming.failing = {45};
  fs::remove(folder_ / "whole/frames/frame.0047.exr");
  const SequenceResult needed = run(warming, "whole", "1-60", stateOptions(Existing::Resume));
  ASSERT_EQ(needed.failed.size(), 1u);
  EXPECT_EQ(needed.failed[0].frame, 47);
  EXPECT_EQ(needed.reused.size(), 59u);
}

}  // namespace
}  // namespace catoptric::run
