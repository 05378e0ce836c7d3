// The low-discrepancy directions of a bake: shifted per point by its number, so that the result
// depends on no order of threads.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "core/basis.h"
#include "core/math.h"

namespace catoptric::trace {

/// x - floor(x).
float fraction(double x);
/// The random shift of point `number`, in the unit square.
Vec2 shiftOf(std::size_t number);
/// A point of the unit square, moved on the torus.
Vec2 shifted(const Vec2& p, const Vec2& shift);
/// R2 points number `first` to `first + count` in the unit square, ordered along a Morton curve so
/// that neighbours stay together.
std::vector<Vec2> latticePoints(int count, int first = 0);
/// Cosine-distributed direction about basis.z (Malley's method).
Vec3 cosineDirection(const Basis& basis, const Vec2& p);

/// Standard error of a mean from the sums of kGroups interleaved groups of its terms.
inline constexpr int kGroups = 4;
float standardError(const std::array<float, kGroups>& sums, float scale);

}  // namespace catoptric::trace
