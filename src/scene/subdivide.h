// Finer triangles, for light that is baked per vertex.
#pragma once

#include "scene/scene.h"

namespace catoptric::scene {

/// Halves all edges that are longer than `longest` after `scale` along each axis, until none is
/// left. The surface stays the same: edges that triangles share are split at the same place, also
/// where their vertices differ. Meshes with morph targets or joints are not changed.
void subdivide(Mesh& mesh, const Vec3& scale, float longest);

}  // namespace catoptric::scene
