// The object's own triangles below a geometry image. Mirrored rays need their normals, which are
// finer than those of the image.
#pragma once

#include "core/math.h"
#include "frame/shading.h"
#include "methods/glossy_lod/filter.h"
#include "methods/glossy_lod/radiance.h"

namespace catoptric::methods::glossy_lod {

/// A ray along `direction`, `width` metres wide, hit a texel of a geometry image. Returns the
/// surface of the triangle under the texel's centre, at the triangle's point nearest to `position`.
/// `scatter`: as in frame::shadeSurface().
frame::SurfacePoint meshSurface(const Shading& shading, const QuadHit& found, const Vec3& position,
                                const Vec3& direction, float width, const Vec2& scatter);

}  // namespace catoptric::methods::glossy_lod
