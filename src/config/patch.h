// JSON patches [RFC 6902].
#pragma once

#include "config/json.h"

namespace catoptric::config {

/// The JSON text of `root` after the operations of a patch. Throws UsageError.
std::string patched(const Value& root, const Value& operations);

}  // namespace catoptric::config
