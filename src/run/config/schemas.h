// JSON Schemas and documentation of the program's files, from the tables that check them.
#pragma once

#include <string>
#include <vector>

#include "methods/contract/method.h"

namespace catoptric::run {

/// "run", "scene", "path".
const std::vector<std::string>& schemaNames();

/// Text of configs/schema/NAME.schema.json. Throws UsageError with the nearest name.
std::string schemaJson(const std::string& name, const std::vector<methods::MethodEntry>& registry);
/// The same as lists in Markdown: docs/config.md is that of "run".
std::string schemaMarkdown(const std::string& name,
                           const std::vector<methods::MethodEntry>& registry);

}  // namespace catoptric::run
