// Descriptions of the methods for `catoptric list`: JSON for programs, and a page for people.
#pragma once

#include <string>
#include <vector>

#include "methods/contract/method.h"

namespace catoptric::app {

/// All members of an entry except the schema of its options.
std::string methodJson(const methods::MethodEntry& entry);

/// A JSON object with the members name, when, meaning and kind.
std::string stepJson(const methods::StepInfo& step);
/// A JSON object with the members name, meaning, must_be_zero and only_with.
std::string counterJson(const methods::CounterInfo& counter);

/// The text of docs/methods.md: steps, counters, tables and layers of the program and of all
/// methods.
std::string methodsPage(const std::vector<methods::MethodEntry>& registry);

}  // namespace catoptric::app
