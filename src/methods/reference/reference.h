// The method `reference`: converged images by Embree, as ground truth. See README.md.
#pragma once

#include "methods/contract/method.h"

namespace catoptric::methods {

const MethodEntry& referenceEntry();

}  // namespace catoptric::methods
