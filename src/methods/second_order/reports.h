// The steps, counters, table and layer of second_order.
#pragma once

#include <vector>

#include "methods/contract/method.h"

namespace catoptric::methods::second_order {

const std::vector<StepInfo>& stepInfos();
const std::vector<CounterInfo>& counterInfos();
/// clusters.csv
const TableInfo& clustersTable();

/// Layer id.cluster.
inline constexpr const char* kClusterLayer = "cluster";

}  // namespace catoptric::methods::second_order
