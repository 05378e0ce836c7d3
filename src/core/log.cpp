#include "core/log.h"

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

namespace catoptric::log {
namespace {

Level currentLevel = Level::Info;

spdlog::logger& logger() {
  static const std::shared_ptr<spdlog::logger> instance = [] {
    auto made = spdlog::stderr_color_mt("catoptric");
    made->set_pattern("%^%l%$: %v");
    made->set_level(spdlog::level::debug);
    return made;
  }();
  return *instance;
}

}  // namespace

void setLevel(Level level) {
  currentLevel = level;
}
Level level() {
  return currentLevel;
}

void debug(const std::string& message) {
  if (currentLevel <= Level::Debug) logger().debug("{}", message);
}
void info(const std::string& message) {
  if (currentLevel <= Level::Info) logger().info("{}", message);
}
void warning(const std::string& message) {
  if (currentLevel <= Level::Warning) logger().warn("{}", message);
}
void error(const std::string& message) {
  if (currentLevel <= Level::Error) logger().error("{}", message);
}

}  // namespace catoptric::log
