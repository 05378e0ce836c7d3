// Measures how long named steps of a frame take, and keeps every measurement.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/clock.h"

namespace catoptric::frame {

struct StepSample {
  int frame = 0;  ///< 0: before the first frame (start-up, loading, precomputation)
  std::string step;
  double seconds = 0.0;
  /// "wall" (glFinish and monotonic clock), "gpu" (timer query), "overlapped" (in a writer thread
  /// while other frames render; not part of the frame's time)
  std::string clock;
  bool first = false;  ///< belongs to the process' first frame
};

/// Collects the measurements of one run. `finishGl` is called before the clock is read at the end
/// of a step, so that the GL work of the step has finished (llvmpipe's timer queries are not
/// reliable).
class StepTimer {
 public:
  void setFinish(std::function<void()> finishGl) { finish_ = std::move(finishGl); }
  /// Measurements added from now on belong to frame `number`.
  void beginFrame(int number);

  /// Runs `body` as step `name` and adds its time, unless it ends by an exception.
  template <class Body>
  auto measure(const char* name, Body&& body) {
    const std::int64_t start = nowNs();
    const auto end = [&] {
      finish();
      add(name, secondsSince(start));
    };
    if constexpr (std::is_void_v<decltype(body())>) {
      body();
      end();
    } else {
      auto result = body();
      end();
      return result;
    }
  }
  /// Waits for all issued GL work. Called at the end of steps that overlap others, which their
  /// caller measures itself.
  void finish() const {
    if (finish_) finish_();
  }
  void add(const std::string& step, double seconds, const std::string& clock = "wall");

  const std::vector<StepSample>& samples() const { return samples_; }
  /// While this object exists, added measurements get names that begin with `text`. Used for the
  /// steps of one of several methods that share a frame.
  class Prefix {
   public:
    Prefix(StepTimer& timer, const std::string& text)
        : timer_(timer), length_(timer.prefix_.size()) {
      timer_.prefix_ += text;
    }
    ~Prefix() { timer_.prefix_.resize(length_); }
    Prefix(const Prefix&) = delete;
    Prefix& operator=(const Prefix&) = delete;

   private:
    StepTimer& timer_;
    std::size_t length_;  ///< of the prefix before
  };

  /// Returns the collected measurements and removes them.
  std::vector<StepSample> take();

 private:
  std::function<void()> finish_;
  int frame_ = 0;
  bool anyFrame_ = false;
  bool first_ = false;
  std::string prefix_;
  std::vector<StepSample> samples_;
};

}  // namespace catoptric::frame
