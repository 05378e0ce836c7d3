// Images of half floats in memory. CPU look-ups in them equal those of the GPU: linear within and
// between levels, seamless across the edges of a cube.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "gl/objects.h"

namespace catoptric::methods::impostors {

/// A square RGBA level with a border of one texel, so that a linear look-up needs no branch.
struct HalfLevel {
  int size = 0;
  std::size_t first = 0;  ///< index of its first value, in the border
};

/// A square RGBA16F texture with all levels, edges clamped.
class HalfImage {
 public:
  /// Reads level 0 and makes the others. Returns the number of clamped texels.
  std::uint64_t read(const gl::Texture& texture);
  /// The same of level 0 given as texels.
  std::uint64_t set(int edge, std::span<const std::uint16_t> texels);
  /// Copies the texels of a level, without its border.
  void copy(int level, std::vector<std::uint16_t>& texels) const;
  const std::vector<HalfLevel>& levels() const { return levels_; }
  const std::uint16_t* values() const { return values_.data(); }

 private:
  std::vector<HalfLevel> levels_;
  std::vector<std::uint16_t> values_;
};

/// Level 0 of an RGBA16F cube map, and its coverage on a coarse level.
class HalfCube {
 public:
  /// `coarse`: the level from which coverage is read.
  void read(const gl::Texture& texture, int coarse);
  const HalfLevel& fine() const { return fine_; }
  const HalfLevel& coarse() const { return coarse_; }
  const std::uint16_t* values() const { return values_.data(); }
  /// Maximum alpha of the coarse level.
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
