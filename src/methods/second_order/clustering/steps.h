// Divides clusters whose parts lie at different depths. Not from the paper.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "methods/second_order/clustering/types.h"

namespace catoptric::methods::second_order {

/// Divides curved clusters whose samples form several height levels along their mean normal. A bin
/// contains all samples of an object with similar normals. The depth image of such a cluster starts
/// at the lower level, so rays from the upper level would hit that level itself. New clusters are
/// appended. `width` in samples.
void divideAtSteps(std::size_t width, int minSamples, std::vector<Cluster>& clusters,
                   std::vector<SampleBlock>& blocks, std::vector<std::uint16_t>& clusterOf);

}  // namespace catoptric::methods::second_order
