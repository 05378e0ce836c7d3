// What lies below a place of a geometry image: the object's own triangles, whose normals mirrored
// rays need finer than an image has them.
#pragma once

#include "core/math.h"
#include "frame/shading.h"
#include "methods/glossy_lod/filter.h"
#include "methods/glossy_lod/radiance.h"

namespace catoptric::methods::glossy_lod {

/// The surface of the triangle at the middle of the texel that was found, where it is nearest to
/// `position`, seen along `direction` by a ray that is `width` metres wide.
frame::SurfacePoint meshSurface(const Shading& shading, const QuadHit& found, const Vec3& position,
                                const Vec3& direction, float width);

}  // namespace catoptric::methods::glossy_lod
