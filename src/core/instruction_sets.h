// Instruction sets that tests force, to see what other processors show.
#pragma once

#include <span>
#include <string>

namespace catoptric {

/// What an environment variable says, one of `names`; empty where it is not set. Throws UsageError
/// for another name.
std::string forcedInstructionSet(const char* variable, std::span<const char* const> names);

}  // namespace catoptric
