// SIGINT and SIGTERM during a run: the first lets the frame at hand be finished, the second ends
// the process at once.
#pragma once

#include <condition_variable>
#include <mutex>
#include <thread>

#include "core/error.h"

namespace catoptric::app {

/// From now on signals are noted. With `jsonLines` what is said then is a JSON line.
void catchStopSignals(bool jsonLines);

/// The signal that asked to stop; 0: none.
int stopSignal();
/// 128 and that signal.
inline ExitCode stoppedCode() {
  return static_cast<ExitCode>(128 + stopSignal());
}

/// Ends the process when a stop that was asked for takes longer than `seconds`: the frame at hand
/// is dropped, all others stay. Frames and GL calls cannot be interrupted otherwise.
class StopDeadline {
 public:
  explicit StopDeadline(double seconds) : thread_([this, seconds] { watch(seconds); }) {}
  ~StopDeadline();
  StopDeadline(const StopDeadline&) = delete;
  StopDeadline& operator=(const StopDeadline&) = delete;

 private:
  void watch(double seconds);

  std::mutex mutex_;
  std::condition_variable changed_;
  bool over_ = false;
  std::thread thread_;  // last: starts when the others are there
};

}  // namespace catoptric::app
