// Divides large meshes into compact cells of similar triangle counts, in which charts then grow.
// Such charts have no slits and cusps, which would be stretched strongly on a square.
#pragma once

#include <cstdint>
#include <vector>

#include "methods/glossy_lod/images/topology.h"

namespace catoptric::methods::glossy_lod {

/// The cell of each triangle. Triangles of a cell are close together and have similar normals.
std::vector<std::uint32_t> findCells(const MeshView& mesh, const Topology& topology,
                                     std::size_t cells);

}  // namespace catoptric::methods::glossy_lod
