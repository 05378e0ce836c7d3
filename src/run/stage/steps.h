// What the steps of the timing tables and the counters of frames mean.
#pragma once

#include <vector>

#include "methods/contract/method.h"

namespace catoptric::run {

/// Steps of the program itself, in the order in which they happen; "beside": by the writers, beside
/// rendering. Those of a method stand in its entry.
const std::vector<methods::StepInfo>& pipelineSteps();
/// Counters of the program itself.
const std::vector<methods::CounterInfo>& pipelineCounters();

}  // namespace catoptric::run
