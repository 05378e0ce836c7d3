// Simplified rotated depth maps [Popescu2006, Sec. 4.1, 4.2]: the depths of a depth map along
// parallel lines in n directions. Each line is reduced to a polyline of at most m points.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/math.h"

namespace catoptric::methods::depth_impostors {

/// Parallel lines over a square of texels. Line j is minor = slope * major + first + j + 1/2, in
/// texels from the corner. Its samples lie at the texel centres along the major axis. DEVIATION:
/// the paper rotates the square. These lines have the same directions, but each sample lies in a
/// column (row) of texels, so that only two texels are read for it.
struct Domain {
  bool alongX = true;  ///< the major axis is x
  float slope = 0.0f;  ///< -1 to 1
  int first = 0;       ///< number of the first line
  int count = 0;
  int offset = 0;  ///< number of lines in the preceding domains
};

/// The domains for the directions pi i / n, i = 0 .. n - 1. They contain all lines that have
/// samples in a square of size x size texels.
std::vector<Domain> makeDomains(int n, int size);

/// A point of a line: position along the major axis in texels, and depth. A negative position marks
/// the start of a span, to which no segment leads. Unused points are kUnused.
using Point = Vec2;
inline constexpr Point kUnused{-1e9f, 0.0f};

struct Simplification {
  std::uint64_t samples = 0;      ///< samples that are not background
  std::uint64_t spans = 0;        ///< runs of such samples along lines
  std::uint64_t lostSpans = 0;    ///< the shortest spans of lines with more than m / 2 spans
  std::uint64_t lostSamples = 0;  ///< samples in lost spans
  void add(const Simplification& other);
};

/// Builds all lines of a size x size map, with m points each, into `into`. Runs in parallel.
void buildSrdm(std::span<const float> texels, int size, std::span<const Domain> domains, int m,
               std::span<Point> into, Simplification& done);

}  // namespace catoptric::methods::depth_impostors
