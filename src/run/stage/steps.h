// The meanings of the steps in timing tables and of the frames' counters.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "methods/contract/method.h"

namespace catoptric::run {

/// The steps of the program itself, in the order in which they occur; "beside" marks steps of the
/// writers, parallel to rendering. A method's own steps are in its entry.
const std::vector<methods::StepInfo>& pipelineSteps();
/// The kinds of steps, also of methods' steps, by name. Steps of methods::StepKind::Rendering are
/// left out.
std::map<std::string, std::string> stepKinds();
/// The counters of the program itself.
const std::vector<methods::CounterInfo>& pipelineCounters();

}  // namespace catoptric::run
