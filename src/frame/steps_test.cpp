#include "frame/steps.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <stdexcept>
#include <thread>

namespace catoptric::frame {
namespace {

TEST(StepTimer, MeasuresWallTimeAndReturnsTheBodysValue) {
  StepTimer timer;
  timer.beginFrame(7);
  const int value = timer.measure("gbuffer", [] {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    return 42;
  });
  EXPECT_EQ(value, 42);
  ASSERT_EQ(timer.samples().size(), 1u);
  const StepSample& sample = timer.samples()[0];
  EXPECT_EQ(sample.frame, 7);
  EXPECT_EQ(sample.step, "gbuffer");
  EXPECT_EQ(sample.clock, "wall");
  EXPECT_GE(sample.seconds, 0.020);
}

TEST(StepTimer, WaitsForGlBeforeTheClockIsRead) {
  StepTimer timer;
  timer.setFinish([] { std::this_thread::sleep_for(std::chrono::milliseconds(20)); });
  timer.measure("composite", [] {});
  EXPECT_GE(timer.samples().at(0).seconds, 0.020);
}

TEST(StepTimer, KeepsNoSampleOfABodyThatThrows) {
  StepTimer timer;
  EXPECT_THROW(timer.measure("trace", []() -> int { throw std::runtime_error("x"); }),
               std::runtime_error);
  EXPECT_TRUE(timer.samples().empty());
}

TEST(StepTimer, MarksTheFirstFrame) {
  StepTimer timer;
  timer.add("load", 1.0);
  for (int frame = 5; frame <= 7; ++frame) {  // of the process, whatever its number
    timer.beginFrame(frame);
    timer.add("gbuffer", 0.1);
  }
  std::vector<bool> first;
  std::vector<int> frames;
  for (const StepSample& sample : timer.samples()) {
    first.push_back(sample.first);
    frames.push_back(sample.frame);
  }
  EXPECT_THAT(first, testing::ElementsAre(false, true, false, false));
  EXPECT_THAT(frames, testing::ElementsAre(0, 5, 6, 7));
}

TEST(StepTimer, TakeHandsSamplesOutOnce) {
  StepTimer timer;
  timer.add("write", 0.5, "overlapped");
  const auto samples = timer.take();
  ASSERT_EQ(samples.size(), 1u);
  EXPECT_EQ(samples[0].clock, "overlapped");
  EXPECT_TRUE(timer.samples().empty());
}

}  // namespace
}  // namespace catoptric::frame
