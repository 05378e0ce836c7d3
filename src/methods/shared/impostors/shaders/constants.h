// Constants that shaders and C++ share: both include the same lines.
#pragma once

#include <cstdint>

namespace catoptric::methods::impostors::shared {

using uint = std::uint32_t;
#include "methods/shared/impostors/shaders/constants.glsl"

}  // namespace catoptric::methods::impostors::shared
