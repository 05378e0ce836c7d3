// Reflections from depth maps of single objects [Popescu2006, Sec. 4], and the environment map.
#pragma once

#include "methods/contract/method.h"

namespace catoptric::methods {

const MethodEntry& depthImpostorsEntry();

}  // namespace catoptric::methods
