// Reflections from billboards [Popescu2006, Sec. 3]: for each reflector, every object is drawn
// into the image of a quad through its centroid. The environment map lies behind all quads.
#pragma once

#include "methods/contract/method.h"

namespace catoptric::methods {

const MethodEntry& billboardsEntry();

}  // namespace catoptric::methods
