#include "app/progress.h"

#include <unistd.h>

#include <array>
#include <cmath>
#include <cstdio>

#include "config/json_text.h"
#include "core/clock.h"
#include "core/error.h"
#include "core/text.h"

namespace catoptric::app {
namespace {

constexpr int kBarWidth = 30;
constexpr std::int64_t kBarIntervalNs = 100'000'000;      // a terminal shows no more
constexpr std::int64_t kPlainIntervalNs = 2'000'000'000;  // a log wants less

std::string ratioText(const run::Progress& progress) {
  std::string text = std::to_string(progress.done) + "/" + std::to_string(progress.toRender);
  if (progress.reused > 0) text += ", " + std::to_string(progress.reused) + " reused";
  if (progress.failed > 0) text += ", " + std::to_string(progress.failed) + " failed";
  return text;
}

}  // namespace

ProgressMode parseProgress(const std::string& text) {
  if (text == "auto") return ::isatty(STDERR_FILENO) != 0 ? ProgressMode::Bar : ProgressMode::Plain;
  if (text == "bar") return ProgressMode::Bar;
  if (text == "plain") return ProgressMode::Plain;
  if (text == "json") return ProgressMode::Json;
  if (text == "none") return ProgressMode::None;
  const std::array<std::string, 5> allowed = {"auto", "bar", "plain", "json", "none"};
  throw UsageError("--progress: \"" + text + "\" is not allowed" + didYouMean(text, allowed) +
                   "; allowed: " + joined(allowed, ", "));
}

std::string durationText(double seconds) {
  std::array<char, 32> text{};
  if (seconds < 10.0) {
    std::snprintf(text.data(), text.size(), "%.1f s", seconds);
    return text.data();
  }
  const auto whole = static_cast<long>(std::lround(seconds));
  if (whole < 60) {
    std::snprintf(text.data(), text.size(), "%ld s", whole);
  } else if (whole < 3600) {
    std::snprintf(text.data(), text.size(), "%ld:%02ld", whole / 60, whole % 60);
  } else {
    std::snprintf(text.data(), text.size(), "%ld:%02ld:%02ld", whole / 3600, whole / 60 % 60,
                  whole % 60);
  }
  return text.data();
}

void ProgressPrinter::endLine() {
  if (onLine_) std::fputc('\n', stderr);
  onLine_ = false;
}

void ProgressPrinter::show(const std::string& method, const run::Progress& progress) {
  if (mode_ == ProgressMode::None) return;
  const bool last = progress.done + progress.failed >= progress.toRender;
  const bool fresh = method != lastMethod_;
  const std::int64_t now = nowNs();
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
    std::fprintf(stderr, "%s\n", line.object().c_str());
    return;
  }
  const std::int64_t interval = mode_ == ProgressMode::Bar ? kBarIntervalNs : kPlainIntervalNs;
  if (!fresh && !last && now - lastNs_ < interval) return;
  lastNs_ = now;
  lastMethod_ = method;
  const std::string left = last ? "in " + durationText(progress.secondsElapsed)
                           : progress.secondsLeft >= 0.0
                               ? durationText(progress.secondsLeft) + " left"
                               : std::string("starting");
  if (mode_ == ProgressMode::Plain) {
    std::fprintf(stderr, "%s: %s, %s\n", method.c_str(), ratioText(progress).c_str(), left.c_str());
    return;
  }
  if (fresh) endLine();
  const int filled =
      progress.toRender > 0 ? kBarWidth * progress.done / progress.toRender : kBarWidth;
  const std::string bar = std::string(static_cast<std::size_t>(filled), '#') +
                          std::string(static_cast<std::size_t>(kBarWidth - filled), '.');
  std::fprintf(stderr, "\r\x1b[K%s [%s] %s, %s", method.c_str(), bar.c_str(),
               ratioText(progress).c_str(), left.c_str());
  std::fflush(stderr);
  onLine_ = true;
  if (last) endLine();
}

}  // namespace catoptric::app
