// Reflections in implicit surfaces as virtual objects, by perturbing sampled paths [Chen2000].
#pragma once

#include <memory>

#include "methods/contract/method.h"
#include "methods/perturbation/options.h"

namespace catoptric::methods {

const MethodEntry& perturbationEntry();

namespace perturbation {
std::unique_ptr<Method> makeMethod(const Options& options);
}

}  // namespace catoptric::methods
