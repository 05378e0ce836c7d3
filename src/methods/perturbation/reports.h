// The steps and counters of perturbation.
#pragma once

#include <vector>

#include "methods/contract/method.h"

namespace catoptric::methods {

const std::vector<StepInfo>& perturbationSteps();
const std::vector<CounterInfo>& perturbationCounters();

}  // namespace catoptric::methods
