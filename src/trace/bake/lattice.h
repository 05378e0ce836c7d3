// The low-discrepancy directions of a bake. Each point shifts them by its rank, so the result does
// not depend on the order of threads, and neighbours fill each other's gaps.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/basis.h"
#include "core/math.h"

namespace catoptric::trace {

/// Multiples of the golden ratio, modulo 1, fill the unit interval evenly.
inline constexpr double kGolden = 0.6180339887498949;
/// x - floor(x).
float fraction(double x);
/// The shift that turns the first points of the R2 sequence into those from number `first` on.
Vec2 sequenceShift(std::uint64_t first);
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
