// Reflections by environment mapping [Greene1986]: the incoming radiance of a reflective sample is
// the cube map's along the reflected direction, as if all it shows were infinitely far away. The
// fastest of the methods, and the one that is wrong wherever the surroundings are near: the
// yardstick that the others must beat, and the fallback of what they do not accept.
#pragma once

#include "methods/contract/method.h"

namespace catoptric::methods {

const MethodEntry& environmentMapEntry();

}  // namespace catoptric::methods
