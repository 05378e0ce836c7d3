// Bins over the spherical coordinates of a normal [Wang2014, section 3.2].
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/math.h"
#include "methods/second_order/clustering/types.h"

namespace catoptric::methods::second_order {

/// Bins of an object over theta (360 degrees) and phi (180 degrees): scale = min(1, density * 100 *
/// its share of the frame / number of visible objects), at least one bin each and 0.04 * density
/// where the share is at least 1/1000. The paper's formula with the area in percent (its print with
/// a fraction gives one bin per object).
struct BinScale {
  float theta = 1.0f;  ///< bins, not rounded: i = floor(theta / 360 * this)
  float phi = 1.0f;
  int thetaBins = 1;
  int phiBins = 1;
};
BinScale binScale(float areaFraction, int visibleObjects, const ClusterOptions& options);

/// Bins begin this share of 360 or 180 degrees early: rooms are full of normals along the axes, and
/// on a border rounding would deal them out to both sides. Ours.
inline constexpr float kBinOffset = 1e-5f;

/// Bins of `count` unit normals, given by their coordinates: theta about +y from +x, phi from +y,
/// both to 2e-6 of a turn. Within 0.1 degrees of a pole theta means nothing and is taken as 0.
void binsOf(const float* x, const float* y, const float* z, std::size_t count,
            const BinScale& scale, std::int32_t* bins);

}  // namespace catoptric::methods::second_order
