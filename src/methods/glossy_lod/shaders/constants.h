// What shaders and C++ share, by the very lines that shaders include.
#pragma once

namespace catoptric::methods::glossy_lod_shared {

#include "methods/glossy_lod/shaders/constants.glsl"

}  // namespace catoptric::methods::glossy_lod_shared
