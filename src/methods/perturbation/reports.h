// What perturbation reports of a frame: its steps and counters, as the program lists them.
#pragma once

#include <vector>

#include "methods/contract/method.h"

namespace catoptric::methods {

const std::vector<StepInfo>& perturbationSteps();
const std::vector<CounterInfo>& perturbationCounters();

}  // namespace catoptric::methods
