// Reflections by environment mapping [Greene1986]: a reflective sample receives the radiance of a
// cube map along its reflected direction, as if all surroundings were infinitely far away. This is
// the fastest method. It is wrong wherever the surroundings are near. Other methods are compared
// with it and fall back to it.
#pragma once

#include "methods/contract/method.h"

namespace catoptric::methods {

const MethodEntry& environmentMapEntry();

}  // namespace catoptric::methods
