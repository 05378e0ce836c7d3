// Simplified rotated depth maps [Popescu2006, Sec. 4.1, 4.2]: the depths along parallel lines of n
// directions over a depth map, each line reduced to a polyline of at most m points.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/math.h"

namespace catoptric::methods::depth_impostors {

/// Parallel lines over a square of texels: line j is minor = slope * major + first + j + 1/2, in
/// texels from the corner, with its samples at the texels' centres along the major axis.
/// DEVIATION: the paper turns the square; these lines have the same directions, and samples of
/// theirs lie on columns (rows) of texels, so that only two texels are read for each.
struct Domain {
  bool alongX = true;  ///< the major axis is x
  float slope = 0.0f;  ///< at most 1 either way
  int first = 0;       ///< of the lines
  int count = 0;
  int offset = 0;  ///< lines of the domains before
};

/// Directions pi i / n, i = 0 .. n - 1, over size x size texels: every line that has a sample.
std::vector<Domain> makeDomains(int n, int size);

/// A point of a line: position along the major axis in texels, depth. The position is negative
/// where no segment leads to the point: at the beginning of a span. Unused points: kUnused.
using Point = Vec2;
inline constexpr Point kUnused{-1e9f, 0.0f};

struct Simplification {
  std::uint64_t samples = 0;      ///< of objects
  std::uint64_t spans = 0;        ///< runs of them along lines
  std::uint64_t lostSpans = 0;    ///< the shortest ones of lines with more than m / 2
  std::uint64_t lostSamples = 0;  ///< in these
  void add(const Simplification& other);
};

/// All lines of all domains of a size x size map, m points each, in parallel; it fills `into`.
void buildSrdm(std::span<const float> texels, int size, std::span<const Domain> domains, int m,
               std::span<Point> into, Simplification& done);

}  // namespace catoptric::methods::depth_impostors
