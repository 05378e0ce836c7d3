// Where rays meet depth maps, on the processor: what rows.glsl and walk.glsl do on the device.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "methods/depth_impostors/columns.h"
#include "methods/depth_impostors/srdm.h"
#include "methods/shared/impostors/ray_batch.h"

namespace catoptric::methods::depth_impostors {

/// The simplified lines of one map.
struct MapLines {
  std::span<const Domain> domains;
  int points = 0;                ///< of a line
  const Point* first = nullptr;  ///< of the first line, with kSpare readable ones behind the last
};
inline constexpr std::size_t kSpare = 9;

/// Sets `at` of all rays by the line of the nearest direction, or by the two nearest; returns the
/// number of segments.
std::uint64_t searchLines(const MapLines& lines, bool twoRows, impostors::MapRays& rays);

/// A depth map, sampled along either axis.
struct MapTexels {
  Columns across;  ///< alongX
  Columns down;
};

/// Sets `at` of all rays, texel by texel along them; returns the number of texels.
std::uint64_t walkTexels(const MapTexels& texels, impostors::MapRays& rays);

/// Walks over so many texels on either side of the places that searchLines() has found: the first
/// crossing there is the place, and where the map shows nothing there the ray meets nothing.
/// Returns the number of texels.
std::uint64_t refineHits(const MapTexels& texels, int reach, impostors::MapRays& rays);

}  // namespace catoptric::methods::depth_impostors
