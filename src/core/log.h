// Messages to a person: always on stderr, never on stdout (which carries data only).
#pragma once

#include <string>

namespace catoptric::log {

enum class Level { Debug, Info, Warning, Error, Silent };

/// Messages below `level` are dropped; Info when never called.
void setLevel(Level level);
Level level();

void debug(const std::string& message);
void info(const std::string& message);
void warning(const std::string& message);
void error(const std::string& message);

}  // namespace catoptric::log
