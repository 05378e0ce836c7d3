// Clusters of parts that lie one behind the other are divided between them. Ours.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "methods/second_order/clustering/types.h"

namespace catoptric::methods::second_order {

/// Divides curved clusters whose samples lie in steps along their mean normal: a bin holds all of
/// an object's samples with similar normals, and an image that sees what stands before the lower
/// step shows the upper one to itself. New clusters follow the others. `width` in samples.
void divideAtSteps(std::size_t width, int minSamples, std::vector<Cluster>& clusters,
                   std::vector<SampleBlock>& blocks, std::vector<std::uint16_t>& clusterOf);

}  // namespace catoptric::methods::second_order
