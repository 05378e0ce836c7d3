// Method `reference`: everything by Embree, converged; the peer in truth. See README.md.
#pragma once

#include "methods/contract/method.h"

namespace catoptric::methods {

const MethodEntry& referenceEntry();

}  // namespace catoptric::methods
