// The method `traced`: Embree traces the reflected rays of the G-buffer. All other methods are
// compared with its speed. See README.md.
#pragma once

#include "methods/contract/method.h"

namespace catoptric::methods {

const MethodEntry& tracedEntry();

}  // namespace catoptric::methods
