// The constants that shaders and C++ share: both include the same lines.
#pragma once

#include <cstdint>

namespace catoptric::raster::shared {

using uint = std::uint32_t;
#include "raster/shaders/constants.glsl"
#include "raster/shaders/masks.glsl"

}  // namespace catoptric::raster::shared
