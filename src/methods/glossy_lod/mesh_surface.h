// The object's own triangles below a geometry image. Mirrored rays need their normals, which are
// finer than those of the image.
#pragma once

#include "core/math.h"
#include "frame/shading.h"
#include "methods/glossy_lod/filter.h"
#include "methods/glossy_lod/radiance.h"

namespace catoptric::methods::glossy_lod {

/// A triangle of an object: p0, p0 + e1, p0 + e2.
struct MeshTriangle {
  Vec3 p0, e1, e2;
  TrianglePlace place;  ///< the centre of the texel
};

/// The triangle under the centre of the texel that was hit.
MeshTriangle triangleUnder(const frame::Geometry& geometry, const SceneImages& images,
                           const QuadHit& found);

/// A ray's direction, mirrored at the triangle under the texel that it hit if it would otherwise
/// hit the triangle's other side: a coarse quad is not parallel to all triangles that it stands
/// for.
Vec3 towardsSide(const frame::Geometry& geometry, const SceneImages& images, const QuadHit& found,
                 const Vec3& direction);

/// A ray along `direction`, `width` metres wide, hit a texel of a geometry image. Returns the
/// surface of the triangle under the texel's centre, at the triangle's point nearest to `position`.
/// `scatter`: as in frame::shadeSurface().
frame::SurfacePoint meshSurface(const Shading& shading, const QuadHit& found, const Vec3& position,
                                const Vec3& direction, float width, const Vec2& scatter);

}  // namespace catoptric::methods::glossy_lod
