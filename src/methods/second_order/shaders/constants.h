// Constants that shaders and C++ share: both include the same lines.
#pragma once

#include <cstdint>

namespace catoptric::methods::second_order_shared {

using uint = std::uint32_t;
#include "methods/second_order/shaders/constants.glsl"

}  // namespace catoptric::methods::second_order_shared
