// Clusters of similar rays by k-means, from those of bins.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "methods/second_order/clustering/types.h"

namespace catoptric::methods::second_order {

/// Deals the samples of each object's clusters that are not planar out anew, each to the nearest
/// mean ray. There are as many means as clusters, but for those that less than `minSamples` samples
/// are nearest to. `width` of the frame, samples. The same for any number of threads. Objects with
/// more than 256 clusters keep their bins: returns how many of their clusters are not planar.
std::size_t moveToNearestMeans(std::size_t width, int minSamples, std::vector<Cluster>& clusters,
                               std::vector<SampleBlock>& blocks,
                               std::vector<std::uint16_t>& clusterOf);

}  // namespace catoptric::methods::second_order
