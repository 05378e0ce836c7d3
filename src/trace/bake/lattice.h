// The low-discrepancy directions of a bake. Each point shifts them by its number, so the result
// does not depend on the order of threads.
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
/// A point of the unit square, shifted with wrap-around.
Vec2 shifted(const Vec2& p, const Vec2& shift);
/// Points number `first` to `first + count - 1` of the R2 sequence in the unit square, sorted along
/// a Morton curve so that neighbours in space are neighbours in the list.
std::vector<Vec2> latticePoints(int count, int first = 0);
/// A cosine-distributed direction about basis.z (Malley's method).
Vec3 cosineDirection(const Basis& basis, const Vec2& p);

/// The standard error of a mean, from the sums of kGroups interleaved groups of its terms.
inline constexpr int kGroups = 4;
float standardError(const std::array<float, kGroups>& sums, float scale);

}  // namespace catoptric::trace
