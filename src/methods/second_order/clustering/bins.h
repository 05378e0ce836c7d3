// Bins over the spherical coordinates of a normal [Wang2014, section 3.2].
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/math.h"
#include "methods/second_order/clustering/types.h"

namespace catoptric::methods::second_order {

/// Numbers of bins of an object over theta (360 degrees) and phi (180 degrees). They are the
/// options' maxima times min(1, density * 100 * fraction of the frame / number of visible objects).
/// They are at least 1, and at least 0.04 * density of the maximum if the fraction is at least
/// 1/1000. This is the paper's formula with the area in percent; as printed, with a fraction, it
/// gives one bin per object.
struct BinScale {
  float theta = 1.0f;  ///< number of bins, not rounded: i = floor(angle / 360 * theta)
  float phi = 1.0f;
  int thetaBins = 1;
  int phiBins = 1;
};
BinScale binScale(float areaFraction, int visibleObjects, const ClusterOptions& options);

/// Bins begin this fraction of 360 or 180 degrees early. Interiors have many normals along the
/// axes, which rounding would otherwise distribute to both sides of a bin's border. Not from the
/// paper.
inline constexpr float kBinOffset = 1e-5f;

/// The bins of `count` unit normals, given by their coordinates: theta about +y from +x, phi from
/// +y, both accurate to 2e-6 of a turn. Within 0.1 degrees of a pole theta is undefined and set to
/// 0.
void binsOf(const float* x, const float* y, const float* z, std::size_t count,
            const BinScale& scale, std::int32_t* bins);

}  // namespace catoptric::methods::second_order
