// The borders of charts, and the arcs that they have in common: an arc runs between places where
// more than two borders meet.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "methods/glossy_lod/images/topology.h"

namespace catoptric::methods::glossy_lod {

/// A run of edges with the same charts on its sides.
struct Arc {
  std::vector<std::uint32_t> vertices;  ///< welded; first and last alike where it is closed
};

/// How a chart's border passes along an arc.
struct ArcUse {
  std::uint32_t arc = 0;
  bool forward = true;
};

struct Chart {
  std::vector<std::uint32_t> triangles;
  std::vector<ArcUse> border;  ///< counter-clockwise, seen from the front; starts where arcs meet
  bool simple = true;          ///< its border is one loop that passes no vertex twice
};

struct Outlines {
  std::vector<Chart> charts;
  std::vector<Arc> arcs;
};

/// Arcs also end at `ends`, welded vertices.
Outlines findOutlines(const Topology& topology, const std::vector<std::int32_t>& chartOf,
                      std::int32_t charts, const std::vector<std::uint32_t>& ends = {});

}  // namespace catoptric::methods::glossy_lod
