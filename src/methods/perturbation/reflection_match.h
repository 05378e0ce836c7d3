// Which reflection of one point continues which of a neighbouring point.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>

#include "methods/perturbation/reflector.h"

namespace catoptric::methods::perturbation {

/// Ends of an edge that show farther apart than this are two reflections where the edge is as short
/// as it gets, pixels (ours).
inline constexpr float kTornEdge = 6.0f;
/// Ends of an edge that show farther apart than so many times its length as seen from the
/// reflector's place may be two reflections (ours).
inline constexpr float kStretch = 4.0f;

/// The reflection nearest to x; none: kMaxReflections.
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

/// Of an edge's middle, the reflection on the way from one of an end to one of the other end.
inline std::size_t nearestBetween(const Reflections& middle, const Reflection& a,
                                  const Reflection& b) {
  return nearestTo(middle, 0.5 * (a.x + b.x));
}

/// The reflection of `b` that continues number `i` of `a`: each is the nearest of the other.
inline std::size_t counterpart(const Reflections& a, std::size_t i, const Reflections& b) {
  if (a.count == 1 && b.count == 1) return 0;
  const std::size_t j = nearestTo(b, a.at[i].x);
  if (j == kMaxReflections || nearestTo(a, b.at[j].x) != i) return kMaxReflections;
  return j;
}

/// Whether there are one or two of each, and number i of one continues number i of the other:
/// most often.
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

/// Whether one end of an edge may have more reflections than were found: the other has others. One
/// at each end is the same.
inline bool lacks(const Reflections& mine, const Reflections& others) {
  if (mine.count == others.count && mine.count < 2) return false;
  const Counterparts mineOf = counterparts(others, mine);
  return std::find(mineOf.begin(), mineOf.begin() + others.count, kMaxReflections) !=
         mineOf.begin() + others.count;
}

/// Where the middle of an edge may be reflected: between what continues from end to end, and where
/// only one end is. More than kMaxReflections where the ends have others.
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
