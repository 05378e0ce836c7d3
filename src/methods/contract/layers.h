// The layers that a run asks for.
#pragma once

#include <algorithm>
#include <string_view>

#include "methods/contract/method.h"

namespace catoptric::methods {

/// Whether the run asks for this layer of RunSettings::layers.
inline bool asksFor(const RunSettings& settings, std::string_view layer) {
  return std::ranges::find(settings.layers, layer) != settings.layers.end();
}

}  // namespace catoptric::methods
