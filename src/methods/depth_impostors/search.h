// Intersects rays with depth maps on the CPU, as rows.glsl and walk.glsl do on the GPU.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "methods/depth_impostors/columns.h"
#include "methods/depth_impostors/srdm.h"
#include "methods/shared/impostors/ray_batch.h"

namespace catoptric::methods::depth_impostors {

/// The simplified lines of one depth map.
struct MapLines {
  std::span<const Domain> domains;
  int points = 0;  ///< number of points of a line
  /// Points of the first line. kSpare readable points follow the last line.
  const Point* first = nullptr;
};
inline constexpr std::size_t kSpare = 9;

/// Intersects all rays with simplified lines and sets MapRays::at. A ray is tested against the line
/// nearest to its projection into the map, or against the two nearest lines (`twoRows`). Returns
/// the number of tested segments.
std::uint64_t searchLines(const MapLines& lines, bool twoRows, impostors::MapRays& rays);

/// The texels of a depth map, stored by columns along either axis.
struct MapTexels {
  Columns across;  ///< for lines with alongX
  Columns down;
};

/// Sets MapRays::at of all rays by marching texel by texel, and MapRays::texels. Returns the number
/// of texels read.
std::uint64_t walkTexels(const MapTexels& texels, impostors::MapRays& rays);

/// Searches `reach` texels on either side of each hit of searchLines() for the first crossing and
/// moves the hit there. If the texels show no surface there, the hit is removed. Returns the number
/// of texels read.
std::uint64_t refineHits(const MapTexels& texels, int reach, impostors::MapRays& rays);

}  // namespace catoptric::methods::depth_impostors
