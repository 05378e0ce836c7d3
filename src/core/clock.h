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

/// Seconds from `startNs` of nowNs() until now.
inline double secondsSince(std::int64_t startNs) {
  return static_cast<double>(nowNs() - startNs) * 1e-9;
}

}  // namespace catoptric
