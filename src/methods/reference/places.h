// Where the primary samples of a pixel lie, and how their lobes are shifted.
#pragma once

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

/// Sample `index` of the four-dimensional Sobol sequence [Joe2008], shifted at random by `noise`:
/// any number of samples from 0 on is spread evenly. Two sequences with different noise are
/// independent.
Place sequencePlace(std::uint32_t index, std::uint32_t noise);

}  // namespace catoptric::methods
