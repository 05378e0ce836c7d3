// Reflections in screen space: reflected rays are followed over the depths of the frame's own
// G-buffer, and see what the frame shows. This is what real-time programs do. What the frame does
// not show is missed; each miss is counted and masked by its reason.
#pragma once

#include "methods/contract/method.h"

namespace catoptric::methods {

const MethodEntry& screenSpaceEntry();

}  // namespace catoptric::methods
