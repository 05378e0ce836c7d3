// What second_order reports of a frame: its steps, counters, table and layer, as the program lists
// them.
#pragma once

#include <vector>

#include "methods/contract/method.h"

namespace catoptric::methods {

const std::vector<StepInfo>& secondOrderSteps();
const std::vector<CounterInfo>& secondOrderCounters();
/// clusters.csv
const TableInfo& clustersTable();

/// Layer id.cluster.
inline constexpr const char* kClusterLayer = "cluster";

}  // namespace catoptric::methods
