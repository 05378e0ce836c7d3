#include "app/progress_printer.h"

#include <fmt/core.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string_view>

#include "config/json_text.h"
#include "core/clock.h"
#include "core/error.h"
#include "core/log.h"
#include "core/text.h"

namespace catoptric::app {
namespace {

constexpr int kBarWidth = 30;
constexpr const char* kEraseLine = "\r\x1b[K";
constexpr std::int64_t kBarIntervalNs = 100'000'000;      // a terminal shows no more
constexpr std::int64_t kPlainIntervalNs = 2'000'000'000;  // a log wants less

std::string ratioText(const run::Progress& progress) {
  std::string text = std::to_string(progress.done) + "/" + std::to_string(progress.toRender);
  if (progress.reused > 0) text += ", " + std::to_string(progress.reused) + " reused";
  if (progress.failed > 0) text += ", " + std::to_string(progress.failed) + " failed";
  return text;
}

}  // namespace

ProgressMode parseProgress(const std::string& text, bool quiet) {
  if (text == "auto") {
    if (quiet) return ProgressMode::None;
    const char* terminal = std::getenv("TERM");
    const bool bars =
        ::isatty(STDERR_FILENO) != 0 && terminal != nullptr && std::string_view(terminal) != "dumb";
    return bars ? ProgressMode::Bar : ProgressMode::Plain;
  }
  if (text == "bar") return ProgressMode::Bar;
  if (text == "plain") return ProgressMode::Plain;
  if (text == "json") return ProgressMode::Json;
  if (text == "none") return ProgressMode::None;
  const std::array<std::string, 5> allowed = {"auto", "bar", "plain", "json", "none"};
  throw UsageError("--progress: \"" + text + "\" is not allowed" + didYouMean(text, allowed) +
                   "; allowed: " + joined(allowed, ", "));
}

std::string durationText(double seconds) {
  if (seconds < 10.0) return fmt::format("{:.1f} s", seconds);
  const long whole = std::lround(seconds);
  if (whole < 60) return fmt::format("{} s", whole);
  if (whole < 3600) return fmt::format("{}:{:02}", whole / 60, whole % 60);
  return fmt::format("{}:{:02}:{:02}", whole / 3600, whole / 60 % 60, whole % 60);
}

ProgressPrinter::ProgressPrinter(ProgressMode mode) : mode_(mode) {
  if (mode_ == ProgressMode::Json)
    log::setFormatter([](log::Level level, const std::string& message) {
      return config::JsonText()
          .add("level", log::levelName(level))
          .add("message", message)
          .object();
    });
  if (mode_ == ProgressMode::Bar)
    log::setAroundLines(
        [this] {
          if (!bar_.empty()) std::fputs(kEraseLine, stderr);
        },
        [this] { std::fputs(bar_.c_str(), stderr); });
}

ProgressPrinter::~ProgressPrinter() {
  endLine();
  log::setAroundLines({}, {});  // what is said later, of errors, stays in the form of the others
}

/// Whether the last line is long enough ago.
bool ProgressPrinter::due(std::int64_t intervalNs) {
  const std::int64_t now = nowNs();
  if (now - lastNs_ < intervalNs) return false;
  lastNs_ = now;
  return true;
}

void ProgressPrinter::finishBar() {
  if (!bar_.empty()) std::fputc('\n', stderr);
  bar_.clear();
}

void ProgressPrinter::endLine() {
  log::exclusively([this] { finishBar(); });
}

void ProgressPrinter::showBar(const std::string& name, double share, const std::string& text) {
  const int filled = std::clamp(static_cast<int>(share * kBarWidth), 0, kBarWidth);
  bar_ = name + " [" + std::string(static_cast<std::size_t>(filled), '#') +
         std::string(static_cast<std::size_t>(kBarWidth - filled), '.') + "] " + text;
  std::fprintf(stderr, "%s%s", kEraseLine, bar_.c_str());
  std::fflush(stderr);
}

void ProgressPrinter::show(const std::string& method, const run::Progress& progress) {
  if (mode_ == ProgressMode::None) return;
  if (mode_ == ProgressMode::Json) {
    config::JsonText line;
    line.add("method", method)
        .add("frame", progress.frame)
        .add("done", progress.done)
        .add("to_render", progress.toRender)
        .add("reused", progress.reused)
        .add("failed", progress.failed)
        .add("seconds", progress.secondsElapsed);
    if (progress.secondsLeft >= 0.0) line.add("seconds_left", progress.secondsLeft);
    log::exclusively([&] { std::fprintf(stderr, "%s\n", line.object().c_str()); });
    return;
  }
  log::exclusively([&] {
    const bool last = progress.done + progress.failed >= progress.toRender;
    const bool fresh = method != lastMethod_;
    const bool isDue = due(mode_ == ProgressMode::Bar ? kBarIntervalNs : kPlainIntervalNs);
    if (!fresh && !last && !isDue) return;
    lastMethod_ = method;
    const std::string left = last ? "in " + durationText(progress.secondsElapsed)
                             : progress.secondsLeft >= 0.0
                                 ? durationText(progress.secondsLeft) + " left"
                                 : std::string("starting");
    const std::string text = ratioText(progress) + ", " + left;
    if (mode_ == ProgressMode::Plain) {
      std::fprintf(stderr, "%s: %s\n", method.c_str(), text.c_str());
      return;
    }
    if (fresh) finishBar();
    showBar(method, progress.toRender > 0 ? 1.0 * progress.done / progress.toRender : 1.0, text);
    if (last) finishBar();
  });
}

void ProgressPrinter::showStep(const std::string& step, double share) {
  if (mode_ == ProgressMode::None) return;
  log::exclusively([&] {
    if (step != lastStep_) lastNs_ = stepStartNs_ = nowNs();  // short steps are not worth a line
    lastStep_ = step;
    if (!due(mode_ == ProgressMode::Plain ? kPlainIntervalNs : kBarIntervalNs)) return;
    const double seconds = static_cast<double>(nowNs() - stepStartNs_) * 1e-9;
    const double left = share > 0.0 ? seconds * (1.0 - share) / share : -1.0;
    if (mode_ == ProgressMode::Json) {
      config::JsonText line;
      line.add("step", step).add("share", share).add("seconds", seconds);
      if (left >= 0.0) line.add("seconds_left", left);
      std::fprintf(stderr, "%s\n", line.object().c_str());
      return;
    }
    const std::string text = std::to_string(static_cast<int>(100.0 * share)) + " %, " +
                             (left >= 0.0 ? durationText(left) + " left" : std::string("starting"));
    if (mode_ == ProgressMode::Plain)
      std::fprintf(stderr, "%s: %s\n", step.c_str(), text.c_str());
    else
      showBar(step, share, text);
  });
}

}  // namespace catoptric::app
