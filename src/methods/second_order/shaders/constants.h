// What shaders and C++ share, by the very lines that shaders include.
#pragma once

#include <cstdint>

namespace catoptric::methods::second_order_shared {

using uint = std::uint32_t;
#include "methods/second_order/shaders/constants.glsl"

}  // namespace catoptric::methods::second_order_shared
