// Lets tests force instruction sets, to reproduce the results of other processors.
#pragma once

#include <span>
#include <string>

namespace catoptric {

/// The value of an environment variable, which must be one of `names`; empty if it is not set.
/// Throws UsageError for any other value.
std::string forcedInstructionSet(const char* variable, std::span<const char* const> names);

}  // namespace catoptric
