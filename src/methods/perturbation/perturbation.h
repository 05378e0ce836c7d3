// Reflections in implicit surfaces as virtual objects, by perturbing sampled paths [Chen2000].
#pragma once

#include "methods/contract/method.h"

namespace catoptric::methods {

const MethodEntry& perturbationEntry();

}  // namespace catoptric::methods
