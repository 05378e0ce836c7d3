// Matches the reflections of one point with those of a neighbouring point.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>

#include "methods/perturbation/reflector.h"

namespace catoptric::methods::perturbation {

/// If the images of an edge's ends are farther apart (pixels) than this when the edge cannot be
/// split further, they are two reflections (not from the paper).
inline constexpr float kTornEdge = 6.0f;
/// If the images of an edge's ends are farther apart than this multiple of the edge's length, as
/// seen from the reflector, they may be two reflections (not from the paper).
inline constexpr float kStretch = 4.0f;

/// The reflection nearest to x; kMaxReflections if there is none.
inline std::size_t nearestTo(const Reflections& reflections, const glm::dvec3& x) {
  std::size_t best = kMaxReflections;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < reflections.count; ++i) {
    const glm::dvec3 way = reflections.at[i].x - x;
    const double apart2 = glm::dot(way, way);
    if (apart2 < least) {
      least = apart2;
      best = i;
    }
  }
  return best;
}

/// The reflection of an edge's middle between reflection `a` of one end and `b` of the other.
inline std::size_t nearestBetween(const Reflections& middle, const Reflection& a,
                                  const Reflection& b) {
  return nearestTo(middle, 0.5 * (a.x + b.x));
}

/// The reflection of `b` that continues reflection `i` of `a`: they are mutually nearest.
inline std::size_t counterpart(const Reflections& a, std::size_t i, const Reflections& b) {
  if (a.count == 1 && b.count == 1) return 0;
  const std::size_t j = nearestTo(b, a.at[i].x);
  if (j == kMaxReflections || nearestTo(a, b.at[j].x) != i) return kMaxReflections;
  return j;
}

/// Whether both have one or two reflections, and those with equal numbers continue each other. This
/// is the most frequent case.
inline bool inOrder(const Reflections& a, const Reflections& b) {
  if (a.count != b.count || a.count == 0 || a.count > 2) return false;
  if (a.count == 1) return true;
  const auto apart2 = [&](std::size_t i, std::size_t j) {
    const glm::dvec3 way = a.at[i].x - b.at[j].x;
    return glm::dot(way, way);
  };
  const double same = std::max(apart2(0, 0), apart2(1, 1));
  return same < apart2(0, 1) && same < apart2(1, 0);
}

/// counterpart() of all reflections of `a`.
using Counterparts = std::array<std::size_t, kMaxReflections>;
inline Counterparts counterparts(const Reflections& a, const Reflections& b) {
  Counterparts result;
  const bool ordered = inOrder(a, b);
  for (std::size_t i = 0; i < a.count; ++i) result[i] = ordered ? i : counterpart(a, i, b);
  return result;
}

/// Whether reflections of one end of an edge may be missing, because the other end has some without
/// a counterpart. With one reflection at each end none is missing.
inline bool lacks(const Reflections& mine, const Reflections& others) {
  if (mine.count == others.count && mine.count < 2) return false;
  const Counterparts mineOf = counterparts(others, mine);
  return std::find(mineOf.begin(), mineOf.begin() + others.count, kMaxReflections) !=
         mineOf.begin() + others.count;
}

/// Where to search for reflections of an edge's middle: halfway between matching reflections of the
/// ends, and at reflections that only one end has. The count may exceed kMaxReflections.
inline Reflections between(const Reflections& a, const Reflections& b) {
  Reflections guess = b;
  for (std::size_t i = 0; i < a.count; ++i) {
    const std::size_t j = counterpart(a, i, b);
    if (j != kMaxReflections) {
      guess.at[j].x = 0.5 * (a.at[i].x + b.at[j].x);
    } else {
      guess.at[guess.count++] = a.at[i];
    }
  }
  return guess;
}

}  // namespace catoptric::methods::perturbation
