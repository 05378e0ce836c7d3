// The surfaces that a bake's rays meet.
#pragma once

#include "frame/geometry.h"
#include "trace/bake/points.h"

namespace catoptric::trace {

/// The geometry with each surface a little behind its own: by a thirty-second of the offset that
/// its points have. Where solids touch, or one stands on a floor, surfaces coincide, and rounding
/// would choose which of them a ray meets. Here a ray inside a solid meets the back of its surface
/// first, and a point at its foot lies outside. The faces of an inner corner move as one, and
/// borders grow, so that hardly any light leaks between surfaces that meet. A sheet of two faces
/// back to back becomes thicker, so that rays meet its fronts. Positions and objects' bounds alone
/// differ from `geometry`.
frame::Geometry insetSurfaces(const frame::Geometry& geometry, const BakePoints& points);

}  // namespace catoptric::trace
