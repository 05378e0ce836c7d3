// Progress messages for frames that take long.
#pragma once

#include <cstdint>
#include <mutex>
#include <string>
#include <utility>

#include "core/clock.h"
#include "core/log.h"

namespace catoptric::methods::perturbation {

/// Logs the current activity of a frame that takes long.
class SlowFrameLog {
 public:
  /// An activity called `name` begins.
  void begin(std::string name) {
    const std::scoped_lock lock(mutex_);
    name_ = std::move(name);
    say();
  }
  /// Any thread reports the number of vertices that it has looked up.
  void add(std::size_t vertices) {
    const std::scoped_lock lock(mutex_);
    vertices_ += vertices;
    say();
  }

 private:
  static constexpr std::int64_t kEveryNs = 10'000'000'000;  ///< not from the paper
  void say() {
    const std::int64_t now = nowNs();
    if (now - last_ < kEveryNs) return;
    last_ = now;
    log::info("perturbation: slow frame: " + std::to_string(vertices_) +
              " vertices processed so far; now: " + name_);
  }

  std::mutex mutex_;
  std::string name_;
  std::uint64_t vertices_ = 0;
  std::int64_t last_ = nowNs();
};

}  // namespace catoptric::methods::perturbation
