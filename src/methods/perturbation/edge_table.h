// The edges of triangles between positions, each edge once.
#pragma once

#include <vector>

#include "methods/perturbation/vertex_table.h"
#include "methods/perturbation/virtual_objects.h"

namespace catoptric::methods::perturbation {

Connectivity::Edges edgesOf(const VertexTable& table,
                            const std::vector<Connectivity::Triangle>& triangles);

}  // namespace catoptric::methods::perturbation
