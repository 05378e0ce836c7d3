// What the steps of the timing tables and the counters of frames mean.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "methods/contract/method.h"

namespace catoptric::run {

/// Steps of the program itself, in the order in which they happen; "beside": by the writers, beside
/// rendering. Those of a method stand in its entry.
const std::vector<methods::StepInfo>& pipelineSteps();
/// The kinds of all steps that are not methods::StepKind::Rendering, the methods' own too, by name.
std::map<std::string, std::string> stepKinds();
/// Counters of the program itself.
const std::vector<methods::CounterInfo>& pipelineCounters();

}  // namespace catoptric::run
