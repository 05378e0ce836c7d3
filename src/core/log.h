// Messages to the user. They always go to stderr, never to stdout, which carries only data. A
// message is a line "level: text". On a terminal it is coloured, except with NO_COLOR
// (no-color.org).
#pragma once

#include <functional>
#include <string>

namespace catoptric::log {

enum class Level { Debug, Info, Warning, Error, Silent };

/// Drops messages below `level`. The default is Info.
void setLevel(Level level);
Level level();
/// Returns "debug", "info", "warning" or "error".
const char* levelName(Level level);

/// Replaces the format "level: text" of messages; an empty function restores it.
void setFormatter(std::function<std::string(Level, const std::string&)> formatter);
/// Sets functions that run before and after each line. They serve code that keeps an unfinished
/// line on the terminal, and must not log. Empty functions remove them.
void setAroundLines(std::function<void()> before, std::function<void()> after);
/// Runs `write` while no other thread prints a message. `write` must not log.
void exclusively(const std::function<void()>& write);

void debug(const std::string& message);
void info(const std::string& message);
void warning(const std::string& message);
void error(const std::string& message);

}  // namespace catoptric::log
