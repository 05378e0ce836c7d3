// Improves the clusters of similar rays by k-means, which starts from the bins.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "methods/second_order/clustering/types.h"

namespace catoptric::methods::second_order {

/// Assigns the samples of an object's curved clusters anew, each to the nearest mean ray. There are
/// as many means as clusters; means with fewer than `minSamples` samples are removed. `width`:
/// width of the frame in samples. The result does not depend on the number of threads. Objects with
/// more than 256 clusters are left unchanged. Returns how many curved clusters such objects have
/// together.
std::size_t moveToNearestMeans(std::size_t width, int minSamples, std::vector<Cluster>& clusters,
                               std::vector<SampleBlock>& blocks,
                               std::vector<std::uint16_t>& clusterOf);

}  // namespace catoptric::methods::second_order
