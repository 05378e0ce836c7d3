// The sequence with a fake source: no scene, no OpenGL.
#include "run/sequence/sequence.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstring>
#include <fstream>
#include <set>
#include <thread>

#include "config/json.h"
#include "core/error.h"
#include "core/file.h"
#include "core/log.h"
#include "run/test_folders.h"

namespace catoptric::run {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;

/// A frame is one pixel: its number, plus, for a source with state, what it carried over.
class FakeSource : public FrameSource {
 public:
  std::vector<frame::StepSample> prepare() override {
    ++prepared;
    if (noDevice) throw DeviceError("no device");
    return {{0, "scene", 0.5, "wall", false}};
  }
  RenderedFrame render(const FrameRequest& request) override {
    const scene::PathFrame& frame = request.frame;
    calls.push_back(frame.number);
    if (failing.count(frame.number) != 0) throw SceneError("cannot draw this");
    RenderedFrame rendered;
    rendered.image = {1, 1, {"R"}, {static_cast<float>(frame.number)}};
    rendered.counters["rays"] = 1;
    rendered.samples = {{frame.number, "gbuffer", 0.0, "wall", false}};
    return rendered;
  }
  std::map<std::string, std::string> context() const override {
    return {{"renderer", renderer}, {"processor", processor}};
  }

  int prepared = 0;
  bool noDevice = false;
  std::string renderer = "fake";
  std::string processor = "CPU A";
  std::vector<int> calls;
  std::set<int> failing;
};

std::vector<EncodedFile> encode(RenderedFrame& frame, const scene::PathFrame& path) {
  std::vector<std::byte> bytes(sizeof(float));
  std::memcpy(bytes.data(), frame.image.data.data(), sizeof(float));
  return {{framePath("frames", path.number, ".exr"), bytes, "encode", 0.001}};
}

/// Tasks for frames 1..count without state.
std::vector<FrameTask> tasks(int count) {
  std::vector<FrameTask> all;
  for (int i = 1; i <= count; ++i) {
    FrameTask task;
    task.frame.number = i;
    task.fingerprints = {"c", "s", "k" + std::to_string(i), "b"};
    all.push_back(task);
  }
  return all;
}

SequenceOptions options(Existing existing = Existing::Error) {
  SequenceOptions o;
  o.existing = existing;
  o.encode = encode;
  return o;
}

TEST(Sequence, MakesAllFramesAndRecords) {
  FakeSource source;
  const fs::path path = freshFolder();
  std::vector<int> seen;
  SequenceOptions o = options();
  o.progress = [&](const Progress& progress) { seen.push_back(progress.done); };
  const SequenceResult result = runSequence(source, tasks(5), path, o);
  EXPECT_THAT(result.rendered, ElementsAre(1, 2, 3, 4, 5));
  EXPECT_TRUE(result.missing.empty());
  EXPECT_THAT(seen, ElementsAre(0, 1, 2, 3, 4, 5));
  EXPECT_EQ(filesOf(path).size(), 5u);
  const config::Value summary = config::parseFile(path / "summary.json");
  EXPECT_EQ(summary.get("device").get("renderer").asString(), "fake");
  EXPECT_EQ(summary.get("counters").get("rays").get("sum").asInteger(), 5);
  EXPECT_EQ(summary.get("steps").keys(),
            (std::vector<std::string>{"encode", "gbuffer", "other", "wait", "write"}));
  EXPECT_EQ(summary.get("startup").keys(), std::vector<std::string>{"scene"});
}

TEST(Sequence, ResumeRendersOnlyWhatIsMissing) {
  const fs::path path = freshFolder();
  FakeSource first;
  first.failing = {3};
  const SequenceResult broken = runSequence(first, tasks(5), path, options());
  EXPECT_THAT(broken.missing, ElementsAre(3, 4, 5));
  ASSERT_EQ(broken.failed.size(), 1u);
  EXPECT_EQ(broken.failed[0].message, "cannot draw this");

  std::ofstream(path / "frames/frame.0002.exr") << "damaged";
  FakeSource second;
  const SequenceResult whole = runSequence(second, tasks(5), path, options(Existing::Resume));
  EXPECT_THAT(second.calls, ElementsAre(2, 3, 4, 5));
  EXPECT_THAT(whole.reused, ElementsAre(1));
  EXPECT_TRUE(whole.missing.empty());

  // Once more: nothing is left to do, and nothing is built for it.
  FakeSource third;
  const SequenceResult again = runSequence(third, tasks(5), path, options(Existing::Resume));
  EXPECT_EQ(third.prepared, 0);
  EXPECT_EQ(again.reused.size(), 5u);

  // The pixels are those of an undisturbed run.
  FakeSource fresh;
  const fs::path other = path.string() + "_fresh";
  fs::remove_all(other);
  runSequence(fresh, tasks(5), other, options());
  EXPECT_EQ(filesOf(path), filesOf(other));
}

TEST(Sequence, ResumeDoesNotTrustOtherCamerasOrRenderers) {
  const fs::path path = freshFolder();
  FakeSource first;
  runSequence(first, tasks(3), path, options());
  std::vector<FrameTask> changed = tasks(3);
  changed[1].fingerprints.camera = "moved";
  FakeSource second;
  runSequence(second, changed, path, options(Existing::Resume));
  EXPECT_THAT(second.calls, ElementsAre(2));
  changed[2].fingerprints.config = "larger";
  FakeSource third;
  third.renderer = "another GPU";  // frame 3 must be made anew, so the others are too
  runSequence(third, changed, path, options(Existing::Resume));
  EXPECT_THAT(third.calls, ElementsAre(1, 2, 3));
}

TEST(Sequence, ResumeKeepsFramesOfAnotherProcessorAndSaysSo) {
  const fs::path path = freshFolder();
  FakeSource first;
  first.renderer = "llvmpipe (LLVM 15.0.6, 256 bits)";
  runSequence(first, tasks(3), path, options());
  std::vector<std::string> warnings;
  log::setFormatter([&](log::Level, const std::string& message) {
    warnings.push_back(message);
    return "";
  });
  FakeSource second;
  second.renderer = "llvmpipe (LLVM 15.0.6, 128 bits)";
  second.processor = "CPU B";
  runSequence(second, tasks(4), path, options(Existing::Resume));
  log::setFormatter({});
  EXPECT_THAT(second.calls, ElementsAre(4));
  EXPECT_THAT(warnings,
              ElementsAre(HasSubstr("2 kinds of machines"), HasSubstr("3 frames (1-3) on CPU A"),
                          HasSubstr("1 frame (4) on CPU B")));
}

TEST(Sequence, AFailedStartLeavesNoFolder) {
  FakeSource source;
  source.noDevice = true;
  const fs::path path = freshFolder();
  EXPECT_THROW(runSequence(source, tasks(3), path, options()), DeviceError);
  EXPECT_FALSE(fs::exists(path));
  source.noDevice = false;
  EXPECT_EQ(runSequence(source, tasks(3), path, options()).rendered.size(), 3u);
  // The frames of an earlier run stay
  source.noDevice = true;
  EXPECT_THROW(runSequence(source, tasks(4), path, options(Existing::Resume)), DeviceError);
  EXPECT_EQ(filesOf(path).size(), 3u);
}

TEST(Sequence, AnOverwrittenRunGoesWhenTheNewOneIsSureToBegin) {
  const fs::path path = freshFolder();
  FakeSource first;
  runSequence(first, tasks(3), path, options());
  const std::string summary = readTextFile(path / "summary.json");
  const auto frames = filesOf(path);
  FakeSource second;
  second.noDevice = true;
  EXPECT_THROW(runSequence(second, tasks(2), path, options(Existing::Overwrite)), DeviceError);
  EXPECT_EQ(filesOf(path), frames);
  EXPECT_EQ(readTextFile(path / "summary.json"), summary);
  second.noDevice = false;
  runSequence(second, tasks(2), path, options(Existing::Overwrite));
  EXPECT_EQ(filesOf(path).size(), 2u);
  EXPECT_NE(readTextFile(path / "summary.json"), summary);
}

TEST(Sequence, FramesThatCannotBeEncodedFailAlone) {
  const fs::path path = freshFolder();
  FakeSource source;
  SequenceOptions o = options();
  o.keepGoing = true;
  o.encode = [](RenderedFrame& frame, const scene::PathFrame& at) {
    if (at.number == 2) throw FrameError("channel R has NaN");
    if (at.number == 3) throw std::bad_alloc();
    return encode(frame, at);
  };
  const SequenceResult result = runSequence(source, tasks(4), path, o);
  EXPECT_THAT(result.rendered, ElementsAre(1, 4));
  ASSERT_EQ(result.failed.size(), 2u);
  EXPECT_EQ(result.failed[0].message, "channel R has NaN");
  EXPECT_EQ(result.failed[1].message, "out of memory");
}

TEST(Sequence, TheForecastIsWhatTheRunDoes) {
  FakeSource source;
  const fs::path path = freshFolder();
  const SequenceForecast first = forecastSequence(tasks(6), path, options());
  EXPECT_THAT(first.rendered, ElementsAre(1, 2, 3, 4, 5, 6));
  EXPECT_FALSE(fs::exists(path));
  runSequence(source, tasks(6), path, options());
  EXPECT_THROW(forecastSequence(tasks(6), path, options()), OutputError);

  fs::remove(path / "frames/frame.0003.exr");
  const SequenceForecast forecast = forecastSequence(tasks(7), path, options(Existing::Resume));
  const SequenceResult result = runSequence(source, tasks(7), path, options(Existing::Resume));
  EXPECT_THAT(forecast.rendered, ElementsAre(3, 7));
  EXPECT_EQ(forecast.rendered, result.rendered);
}

TEST(Sequence, KeepGoingListsTheFailed) {
  const fs::path path = freshFolder();
  FakeSource source;
  source.failing = {2, 4};
  SequenceOptions o = options();
  o.keepGoing = true;
  const SequenceResult result = runSequence(source, tasks(5), path, o);
  EXPECT_THAT(result.rendered, ElementsAre(1, 3, 5));
  EXPECT_THAT(result.missing, ElementsAre(2, 4));
  EXPECT_EQ(result.failed.size(), 2u);
}

TEST(Sequence, StopLeavesAResumableRun) {
  const fs::path path = freshFolder();
  FakeSource source;
  SequenceOptions o = options();
  o.stopRequested = [&] { return source.calls.size() == 2; };
  const SequenceResult result = runSequence(source, tasks(5), path, o);
  EXPECT_TRUE(result.stopped);
  EXPECT_THAT(result.rendered, ElementsAre(1, 2));
  EXPECT_THAT(result.missing, ElementsAre(3, 4, 5));
  FakeSource rest;
  const SequenceResult resumed = runSequence(rest, tasks(5), path, options(Existing::Resume));
  EXPECT_THAT(rest.calls, ElementsAre(3, 4, 5));
  EXPECT_TRUE(resumed.missing.empty());
}

TEST(Sequence, WriteErrorsReachTheCaller) {
  FakeSource source;
  SequenceOptions o = options();
  o.encode = [](RenderedFrame& frame, const scene::PathFrame& path) {
    std::vector<EncodedFile> files = encode(frame, path);
    if (path.number == 2) files[0].path = "no/such/folder/frame.exr";
    return files;
  };
  const fs::path path = freshFolder();
  EXPECT_THROW(runSequence(source, tasks(50), path, o), OutputError);
  EXPECT_LT(source.calls.size(), 50u);  // rendering did not go on for nothing
  EXPECT_THAT(readTextFile(path / "frames.jsonl"), HasSubstr("\"frame\":1"));
}

TEST(Sequence, EncodeErrorsFailTheirFrameAlone) {
  FakeSource source;
  SequenceOptions o = options();
  o.keepGoing = true;
  o.encode = [](RenderedFrame& frame, const scene::PathFrame& path) {
    if (path.number == 2) throw Error(ExitCode::Internal, "bad image");
    return encode(frame, path);
  };
  const SequenceResult result = runSequence(source, tasks(4), freshFolder(), o);
  EXPECT_THAT(result.rendered, ElementsAre(1, 3, 4));
  EXPECT_THAT(result.missing, ElementsAre(2));
  EXPECT_EQ(result.failed.at(0).message, "bad image");
}

TEST(Sequence, WritingOverlapsRenderingWithABound) {
  FakeSource source;
  SequenceOptions o = options();
  o.writerThreads = 1;
  o.queueFrames = 2;
  std::atomic<int> encoded{0};
  int furthestAhead = 0;
  o.encode = [&](RenderedFrame& frame, const scene::PathFrame& path) {
    std::this_thread::sleep_for(std::chrono::milliseconds(3));
    ++encoded;
    return encode(frame, path);
  };
  o.progress = [&](const Progress& p) {
    furthestAhead = std::max(furthestAhead, p.done - encoded);
  };
  runSequence(source, tasks(20), freshFolder(), o);
  EXPECT_EQ(encoded, 20);
  EXPECT_GE(furthestAhead, 2);
  EXPECT_LE(furthestAhead, 4);  // two in the queue, one being written, one just counted
}

TEST(Sequence, WritersLeaveTheProcessorsToRendering) {
  FakeSource source;
  SequenceOptions o = options();
  const int ours = ::getpriority(PRIO_PROCESS, 0);
  std::atomic<int> theirs{-100};
  o.encode = [&](RenderedFrame& frame, const scene::PathFrame& path) {
    theirs = ::getpriority(PRIO_PROCESS, 0);
    return encode(frame, path);
  };
  runSequence(source, tasks(1), freshFolder(), o);
  EXPECT_EQ(theirs, std::min(19, ours + 5));
  EXPECT_EQ(::getpriority(PRIO_PROCESS, 0), ours);
}

TEST(Sequence, ChunkTextAndRanges) {
  EXPECT_THAT(chunkBounds(tasks(10), 3), ElementsAre(0, 3, 6, 10));
  EXPECT_THAT(chunkBounds(tasks(2), 4), ElementsAre(0, 0, 1, 1, 2));
  EXPECT_THAT(chunkBounds({}, 2), ElementsAre(0, 0, 0));
  EXPECT_EQ(parseChunk("2/3").index, 2);
  for (const char* text : {"", "1", "0/3", "4/3", "1/0", "1/3x", "-1/3", "1/ 3"})
    EXPECT_THROW(parseChunk(text), UsageError) << text;
}

}  // namespace
}  // namespace catoptric::run
