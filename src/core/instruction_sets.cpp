#include "core/instruction_sets.h"

#include <algorithm>
#include <cstdlib>

#include "core/error.h"

namespace catoptric {

std::string forcedInstructionSet(const char* variable, std::span<const char* const> names) {
  const char* value = std::getenv(variable);
  if (value == nullptr || *value == '\0') return {};
  std::string wanted = value;
  if (std::ranges::any_of(names, [&](const char* name) { return wanted == name; })) return wanted;
  std::string allowed;
  for (const char* name : names) allowed += (allowed.empty() ? "" : ", ") + std::string(name);
  throw UsageError(std::string(variable) + " is '" + wanted + "'; allowed: " + allowed);
}

}  // namespace catoptric
