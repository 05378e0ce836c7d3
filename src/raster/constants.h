// What shaders and C++ share, by the very lines that shaders include.
#pragma once

#include <cstdint>

namespace catoptric::raster::shared {

using uint = std::uint32_t;
#include "raster/shaders/constants.glsl"
#include "raster/shaders/masks.glsl"

}  // namespace catoptric::raster::shared
