// Where the primary samples of a pixel lie, and how their lobes are shifted.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/math.h"

namespace catoptric::methods {

struct Place {
  Vec2 at{0.5f};       ///< in the pixel, 0..1
  Vec2 shift{0.5f};    ///< trace::ReflectionPoint::shift
  Vec2 scatter{0.5f};  ///< as for frame::shadeSurface()
};

/// Random bits of a pixel.
std::uint32_t pixelNoise(int x, int y, std::uint64_t seed);

/// Sample `index` of a regular grid of `samples` x `samples` in pixel (x, y), as in a G-buffer with
/// as many samples. The lobes of a pixel interleave; pixels are shifted against each other by
/// `noise`.
Place gridPlace(int x, int y, int index, int samples, std::uint32_t noise);

/// Neighbouring samples of the four-dimensional Sobol sequence [Joe2008], for many pixels.
class SobolSamples {
 public:
  static constexpr std::size_t kMost = 16;

  /// Samples first..first + count.
  SobolSamples(std::uint32_t first, std::size_t count);

  /// Sets places[0..count) to the samples after Owen scrambling by `noise`, as hashing does it
  /// [Burley2020]: any number of samples from 0 on is spread evenly. Two sequences with different
  /// noise are independent.
  void place(std::uint32_t noise, Place* places) const;

 private:
  using Numbers = std::array<std::uint32_t, kMost>;

  std::uint32_t first_;
  std::size_t count_;
  std::array<Numbers, 4> reversed_{};  ///< coordinates, lowest bit first
};

}  // namespace catoptric::methods
