// The monotonic clock that every timing uses.
#pragma once

#include <chrono>
#include <cstdint>

namespace catoptric {

/// Nanoseconds of the monotonic clock; only differences mean anything.
inline std::int64_t nowNs() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

}  // namespace catoptric
