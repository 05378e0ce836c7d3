#include "core/log.h"

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <mutex>
#include <set>

#include "core/text.h"

namespace catoptric::log {
namespace {

/// What all messages share; never destroyed, as threads may log until the process ends.
struct State {
  std::atomic<Level> level{Level::Info};
  std::mutex mutex;  ///< of all below, and of the lines on stderr
  std::function<std::string(Level, const std::string&)> formatter;
  std::function<void()> before;
  std::function<void()> after;
  std::set<std::string> said;  ///< infos and warnings: one that equals an earlier one is dropped
};
State& state() {
  static State* const all = new State;
  return *all;
}

spdlog::logger& logger() {
  static const std::shared_ptr<spdlog::logger> instance = [] {
    const char* noColour = std::getenv("NO_COLOR");
    const bool plain = noColour != nullptr && *noColour != '\0';
    auto made = spdlog::stderr_color_mt(
        "catoptric", plain ? spdlog::color_mode::never : spdlog::color_mode::automatic);
    made->set_pattern("%^%l%$: %v");
    made->set_level(spdlog::level::debug);
    return made;
  }();
  return *instance;
}

void print(Level level, spdlog::level::level_enum shown, const std::string& text) {
  State& all = state();
  if (all.level > level) return;
  const std::string message = printable(text);  // names of files and objects are not ours
  const std::scoped_lock lock(all.mutex);
  if (level < Level::Error && level > Level::Debug && !all.said.insert(message).second) return;
  if (all.before) all.before();
  if (all.formatter) {
    std::fprintf(stderr, "%s\n", all.formatter(level, message).c_str());
    std::fflush(stderr);
  } else {
    logger().log(shown, "{}", message);
  }
  if (all.after) all.after();
}

}  // namespace

void setLevel(Level level) {
  state().level = level;
}
Level level() {
  return state().level;
}

const char* levelName(Level level) {
  switch (level) {
    case Level::Debug:
      return "debug";
    case Level::Info:
      return "info";
    case Level::Warning:
      return "warning";
    case Level::Error:
    case Level::Silent:
      return "error";
  }
  return "";
}

void setFormatter(std::function<std::string(Level, const std::string&)> formatter) {
  const std::scoped_lock lock(state().mutex);
  state().formatter = std::move(formatter);
  state().said.clear();
}
void setAroundLines(std::function<void()> before, std::function<void()> after) {
  const std::scoped_lock lock(state().mutex);
  state().before = std::move(before);
  state().after = std::move(after);
}
void exclusively(const std::function<void()>& write) {
  const std::scoped_lock lock(state().mutex);
  write();
}

void debug(const std::string& message) {
  print(Level::Debug, spdlog::level::debug, message);
}
void info(const std::string& message) {
  print(Level::Info, spdlog::level::info, message);
}
void warning(const std::string& message) {
  print(Level::Warning, spdlog::level::warn, message);
}
void error(const std::string& message) {
  print(Level::Error, spdlog::level::err, message);
}

}  // namespace catoptric::log
