// Step times of frames: wall clock around named steps, every sample kept.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "core/clock.h"

namespace catoptric::frame {

struct StepSample {
  int frame = 0;  ///< 0: before the first frame (start-up, load, precomputation)
  std::string step;
  double seconds = 0.0;
  std::string clock;   ///< "wall" (glFinish and monotonic clock), "gpu" (timer query), "overlapped"
  bool first = false;  ///< of the process' first frame
};

/// Collects samples of one run. `finishGl` is called before a step's clock is read, so that the
/// work issued inside has ended (llvmpipe's timer queries lie).
class StepTimer {
 public:
  void setFinish(std::function<void()> finishGl) { finish_ = std::move(finishGl); }
  /// Samples added from now on belong to frame `number`.
  void beginFrame(int number);

  /// Runs `body` as step `name`; the time is added when it ends, also by an exception.
  template <class Body>
  auto measure(const char* name, Body&& body) {
    const Scope scope(*this, name);
    return body();
  }
  /// Waits for the work issued so far, for steps that overlap and are timed by their caller.
  void finish() const {
    if (finish_) finish_();
  }
  void add(const std::string& step, double seconds, const std::string& clock = "wall");

  const std::vector<StepSample>& samples() const { return samples_; }
  /// While it lives, what is added has names that begin with `text`: steps of one of several
  /// methods of a frame.
  class Prefix {
   public:
    Prefix(StepTimer& timer, std::string text) : timer_(timer) { timer_.prefix_ = std::move(text); }
    ~Prefix() { timer_.prefix_.clear(); }
    Prefix(const Prefix&) = delete;
    Prefix& operator=(const Prefix&) = delete;

   private:
    StepTimer& timer_;
  };

  /// Hands out the samples collected so far and forgets them.
  std::vector<StepSample> take();

 private:
  struct Scope {
    Scope(StepTimer& t, const char* n) : timer(t), name(n), start(nowNs()) {}
    ~Scope() {
      if (timer.finish_) timer.finish_();
      timer.add(name, secondsSince(start));
    }
    StepTimer& timer;
    const char* name;
    std::int64_t start;
  };
  std::function<void()> finish_;
  int frame_ = 0;
  bool anyFrame_ = false;
  bool first_ = false;
  std::string prefix_;
  std::vector<StepSample> samples_;
};

}  // namespace catoptric::frame
