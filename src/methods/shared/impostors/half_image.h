// Images of half floats in memory, for look-ups by the processor that equal the device's: linear
// within levels and between them, seamless over the edges of a cube.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "gl/objects.h"

namespace catoptric::methods::impostors {

/// A square level in a border of one texel, RGBA: what a linear look-up needs without a branch.
struct HalfLevel {
  int size = 0;
  std::size_t first = 0;  ///< its first value, of the border
};

/// A square RGBA16F texture with all levels, edges clamped.
class HalfImage {
 public:
  /// Reads level 0 and makes the others; returns how many of its texels half floats have clamped.
  std::uint64_t read(const gl::Texture& texture);
  const std::vector<HalfLevel>& levels() const { return levels_; }
  const std::uint16_t* values() const { return values_.data(); }

 private:
  std::vector<HalfLevel> levels_;
  std::vector<std::uint16_t> values_;
};

/// Level 0 of an RGBA16F cube map, and how much of it is covered on a level of few texels.
class HalfCube {
 public:
  /// `coarse`: the level that is asked for coverage.
  void read(const gl::Texture& texture, int coarse);
  const HalfLevel& fine() const { return fine_; }
  const HalfLevel& coarse() const { return coarse_; }
  const std::uint16_t* values() const { return values_.data(); }
  /// The most of the coarse level's alpha.
  float mostCoverage() const { return most_; }

 private:
  void add(const gl::Texture& texture, int level, HalfLevel& into);

  HalfLevel fine_;
  HalfLevel coarse_;
  float most_ = 0.0f;
  std::vector<std::uint16_t> values_;
  std::vector<std::uint16_t> read_;
};

}  // namespace catoptric::methods::impostors
