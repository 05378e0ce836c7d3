// Large meshes are cut into cells first, compact ones of about as many triangles each: charts that
// grow where these end have no slits and cusps, which a square shows only with much stretch.
#pragma once

#include <cstdint>
#include <vector>

#include "methods/glossy_lod/images/topology.h"

namespace catoptric::methods::glossy_lod {

/// Per triangle the number of its cell: those near in place and alike in normal are of one.
std::vector<std::uint32_t> findCells(const MeshView& mesh, const Topology& topology,
                                     std::size_t cells);

}  // namespace catoptric::methods::glossy_lod
