// The surfaces with which a bake's rays are intersected.
#pragma once

#include "frame/geometry.h"
#include "trace/bake/points.h"

namespace catoptric::trace {

/// A copy of the geometry in which each surface is moved slightly behind its original position, by
/// 1/32 of the offset of its points. Positions and the objects' bounds alone differ. Reason: where
/// solids touch, or stand on a floor, surfaces coincide, and rounding would decide which one a ray
/// hits. In the moved geometry, a ray inside a solid hits the back of the solid's surface first,
/// and a point at the foot of a solid lies outside. The faces of an inner corner move together and
/// borders grow, so that hardly any light leaks between surfaces that meet. A sheet of two faces
/// back to back becomes thicker, so that rays hit its front faces.
frame::Geometry insetSurfaces(const frame::Geometry& geometry, const BakePoints& points);

}  // namespace catoptric::trace
