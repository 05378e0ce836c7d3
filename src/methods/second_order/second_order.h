// Method second_order [Wang2014]: reflected rays in clusters, a depth image for each, found by
// walking over it.
#pragma once

#include "methods/contract/method.h"

namespace catoptric::methods {

const MethodEntry& secondOrderEntry();

/// For second_order_benchmark: frames also draw, as step "reads", what `intersect` must at least
/// read and write.
void setMeasureReads(bool on);

}  // namespace catoptric::methods
