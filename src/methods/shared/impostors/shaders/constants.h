// What shaders and C++ share, by the very lines that shaders include.
#pragma once

#include <cstdint>

namespace catoptric::methods::impostors::shared {

using uint = std::uint32_t;
#include "methods/shared/impostors/shaders/constants.glsl"

}  // namespace catoptric::methods::impostors::shared
