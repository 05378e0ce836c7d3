// The manual page and the completion of command lines, made from the program's own options.
#pragma once

#include <string>

#include "app/command.h"

namespace catoptric::app {

/// docs/man/catoptric.1: the page of `man catoptric`.
std::string manPage(const Program& program);

/// What completes the program's command lines in "bash" or "zsh". Throws UsageError for others.
std::string completion(const Program& program, const std::string& shell);

}  // namespace catoptric::app
