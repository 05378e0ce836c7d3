// Method second_order [Wang2014]: reflected rays in clusters, a depth image for each, found by
// walking over it.
#pragma once

#include "methods/method.h"

namespace catoptric::methods {

const MethodEntry& secondOrderEntry();

}  // namespace catoptric::methods
