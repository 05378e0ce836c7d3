// The gradient alone, as normals need it, at a fraction of the cost of all derivatives.
#pragma once

#include <optional>

#include "scene/implicit/surface.h"

namespace catoptric::implicit {

/// The gradient with respect to world coordinates; nullopt where it is zero or not finite (a cone's
/// apex, a vase's axis).
std::optional<Point> gradientAt(const Surface& surface, const Point& world);

/// Unit normal on the side where g > 0; nullopt where there is none.
std::optional<Point> normalAt(const Surface& surface, const Point& world);

/// The point of the surface that Newton's method along the gradient reaches from `world`, inside
/// the domain. nullopt if it does not converge within the distance `reach`. It takes a few steps,
/// so `world` should lie near the surface.
std::optional<Point> nearestPoint(const Surface& surface, const Point& world, double reach);

}  // namespace catoptric::implicit
