// Tangent frames for normal maps.
#pragma once

#include <cstddef>

#include "scene/scene.h"

namespace catoptric::scene {

/// Computes tangents of `mesh` from the texture coordinates of `slot` (including its transform), in
/// the manner of MikkTSpace. A tangent is the angle-weighted sum over the vertex's triangles,
/// projected onto the plane of the normal. w is 1 where cross(normal, tangent) points up in the
/// image (against v). A vertex whose triangles disagree on this side (mirrored texture coordinates)
/// is split into two. Triangles without area, in space or in texture coordinates, contribute
/// nothing. A vertex with no other triangles gets an arbitrary perpendicular tangent. Normals must
/// have unit length. Returns the number of vertices with such an arbitrary tangent.
std::size_t makeTangents(Mesh& mesh, const TextureSlot& slot);

/// A unit vector perpendicular to the unit vector `n`.
Vec3 anyPerpendicular(const Vec3& n);

}  // namespace catoptric::scene
