// Handles SIGINT and SIGTERM during a run. After the first signal the current frame is finished;
// the second ends the process at once.
#pragma once

#include <condition_variable>
#include <mutex>
#include <thread>

#include "core/error.h"

namespace catoptric::app {

/// Installs the handlers. With `jsonLines`, the message after a signal is a JSON line.
void catchStopSignals(bool jsonLines);

/// The signal that requested a stop; 0: none.
int stopSignal();
/// The exit code after a stop: 128 plus the number of the signal.
inline ExitCode stoppedCode() {
  return static_cast<ExitCode>(128 + stopSignal());
}

/// Ends the process if a requested stop takes longer than `seconds`. The current frame is lost, all
/// others stay. This is needed because frames and GL calls cannot be interrupted.
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
  std::thread thread_;  // declared last: starts when the other members exist
};

}  // namespace catoptric::app
