// Tangent frames for normal maps.
#pragma once

#include <cstddef>

#include "scene/scene.h"

namespace catoptric::scene {

/// Gives `mesh` tangents made from the texture coordinates of `slot` (its transform included), in
/// the manner of MikkTSpace: angle-weighted sums over the triangles of each vertex, projected onto
/// the plane of the normal; w is 1 where cross(normal, tangent) points up in the image (against v).
/// A vertex whose triangles disagree on the side (mirrored texture coordinates) is split in two.
/// Triangles without area, in space or in texture coordinates, add nothing; a vertex without any
/// other gets some perpendicular tangent. Normals must be unit. Returns the number of vertices with
/// such a made-up tangent.
std::size_t makeTangents(Mesh& mesh, const TextureSlot& slot);

/// Some unit vector perpendicular to unit vector `n`.
Vec3 anyPerpendicular(const Vec3& n);

}  // namespace catoptric::scene
