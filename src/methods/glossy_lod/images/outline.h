// The borders of charts, divided into arcs. Arcs end where more than two charts meet.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "methods/glossy_lod/images/topology.h"

namespace catoptric::methods::glossy_lod {

/// A run of edges with the same two charts on its sides.
struct Arc {
  std::vector<std::uint32_t> vertices;  ///< welded; closed if first and last are equal
};

/// An arc as part of a chart's border, with its direction.
struct ArcUse {
  std::uint32_t arc = 0;
  bool forward = true;
};

struct Chart {
  std::vector<std::uint32_t> triangles;
  std::vector<ArcUse> border;  ///< counter-clockwise from the front; starts at an arc's end
  bool simple = true;          ///< the border is one loop that passes no vertex twice
};

struct Outlines {
  std::vector<Chart> charts;
  std::vector<Arc> arcs;
};

/// Arcs also end at the welded vertices `ends`.
Outlines findOutlines(const Topology& topology, const std::vector<std::int32_t>& chartOf,
                      std::int32_t charts, const std::vector<std::uint32_t>& ends = {});

}  // namespace catoptric::methods::glossy_lod
