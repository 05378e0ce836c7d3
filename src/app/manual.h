// The manual page and the shell completion, generated from the program's own options.
#pragma once

#include <string>

#include "app/command.h"

namespace catoptric::app {

/// The text of docs/man/catoptric.1, the page of `man catoptric`.
std::string manPage(const Program& program);

/// The completion script for "bash" or "zsh". Throws UsageError for other shells.
std::string completion(const Program& program, const std::string& shell);

}  // namespace catoptric::app
