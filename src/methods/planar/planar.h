// Reflections in flat mirrors by mirrored cameras: the scene is drawn once more for each plane, as
// seen from the eye's mirror image, into the mirror's own samples. This is exact for flat mirrors;
// others are unsupported.
#pragma once

#include "methods/contract/method.h"

namespace catoptric::methods {

const MethodEntry& planarEntry();

}  // namespace catoptric::methods
