#include "app/stop_signals.h"

#include <unistd.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <string_view>

#include "core/log.h"

namespace catoptric::app {
namespace {

std::atomic<int> noted{0};
std::atomic<bool> asJson{false};
static_assert(std::atomic<int>::is_always_lock_free, "a signal handler uses it");

constexpr std::string_view kText = "\nstopping after this frame; a second signal stops at once\n";
constexpr std::string_view kJson =
    "{\"level\":\"info\",\"message\":\"stopping after this frame; a second signal stops at "
    "once\"}\n";

void noteSignal(int number) {
  // A second signal, of either kind, ends at once: what stands on the disk is complete.
  if (noted.exchange(number) != 0) ::_exit(128 + number);
  const std::string_view message = asJson ? kJson : kText;
  // Nothing else may be called here; a message that cannot be written is no loss.
  [[maybe_unused]] const ssize_t written = ::write(STDERR_FILENO, message.data(), message.size());
}

}  // namespace

void catchStopSignals(bool jsonLines) {
  asJson = jsonLines;
  struct sigaction action {};
  action.sa_handler = noteSignal;
  action.sa_flags = static_cast<int>(SA_RESTART);
  ::sigaction(SIGINT, &action, nullptr);
  ::sigaction(SIGTERM, &action, nullptr);
}

int stopSignal() {
  return noted;
}

StopDeadline::~StopDeadline() {
  {
    const std::scoped_lock lock(mutex_);
    over_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void StopDeadline::watch(double seconds) {
  constexpr auto kInterval = std::chrono::milliseconds(100);
  std::unique_lock lock(mutex_);
  double waited = 0.0;
  while (!changed_.wait_for(lock, kInterval, [this] { return over_; })) {
    if (noted == 0) continue;
    waited += std::chrono::duration<double>(kInterval).count();
    if (waited < seconds) continue;
    log::warning("the current frame is dropped; --existing resume continues the run");
    ::_exit(128 + noted);
  }
}

}  // namespace catoptric::app
