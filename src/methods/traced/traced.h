// Method `traced`: reflected rays of the G-buffer by Embree, the peer in speed of every other
// method. See README.md.
#pragma once

#include "methods/contract/method.h"

namespace catoptric::methods {

const MethodEntry& tracedEntry();

}  // namespace catoptric::methods
