// Reflections from billboards [Popescu2006, Sec. 3]: an image of each object on a quad through its
// centroid, made for each reflector, and the environment map behind all.
#pragma once

#include "methods/contract/method.h"

namespace catoptric::methods {

const MethodEntry& billboardsEntry();

}  // namespace catoptric::methods
