// Messages to a person: always on stderr, never on stdout (which carries data only). A message is a
// line "level: text"; with colours on a terminal, unless NO_COLOR is set (no-color.org).
#pragma once

#include <functional>
#include <string>

namespace catoptric::log {

enum class Level { Debug, Info, Warning, Error, Silent };

/// Messages below `level` are dropped; Info when never called.
void setLevel(Level level);
Level level();
/// "debug", "info", "warning", "error".
const char* levelName(Level level);

/// Makes the lines of messages instead of "level: text"; an empty function restores that.
void setFormatter(std::function<std::string(Level, const std::string&)> formatter);
/// Called before and after each line, of who keeps an unfinished line on the terminal: it must not
/// log. Empty functions: nobody.
void setAroundLines(std::function<void()> before, std::function<void()> after);
/// Runs `write` while no message is printed; it must not log.
void exclusively(const std::function<void()>& write);

void debug(const std::string& message);
void info(const std::string& message);
void warning(const std::string& message);
void error(const std::string& message);

}  // namespace catoptric::log
