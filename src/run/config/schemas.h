// JSON Schemas and documentation of the program's file formats, from the same tables that check the
// files.
#pragma once

#include <string>
#include <vector>

#include "methods/contract/method.h"

namespace catoptric::run {

/// Returns "run", "scene" and "path".
const std::vector<std::string>& schemaNames();

/// The text of configs/schema/NAME.schema.json. Throws UsageError with the nearest name.
std::string schemaJson(const std::string& name, const std::vector<methods::MethodEntry>& registry);
/// The schema as Markdown lists. docs/config.md contains that of "run".
std::string schemaMarkdown(const std::string& name,
                           const std::vector<methods::MethodEntry>& registry);

}  // namespace catoptric::run
