// FLIP: the perceived difference between two images when a viewer alternates between them, 0..1 per
// pixel. LDR-FLIP [Andersson2020] and HDR-FLIP [Andersson2021]. This is our own implementation. All
// its 2D filters are sums of separable filters and are applied as such.
#pragma once

#include <array>
#include <vector>

#include "measure/colours.h"

namespace catoptric::measure {

struct FlipOptions {
  /// Pixels per degree of the viewer's field of view: a screen 0.7 m wide with 3840 pixels, 0.7 m
  /// away. [Andersson2020] Sec. 5.1
  float pixelsPerDegree = 67.0206433f;
  /// HDR-FLIP's exposures, in stops. They are the same for all frames, so that frames can be
  /// compared; the papers derive them from one reference image. There are as many exposures as
  /// the range has stops (6), as in [Andersson2021] Sec. 4.
  float startExposure = -3.0f;
  float stopExposure = 3.0f;
  int exposures = 6;
};

/// LDR-FLIP of the values clamped to 0..1 (the colours of an sRGB screen before rounding to 8
/// bits). Pixels that are not finite in either image have an error of 1 and count as black for
/// their neighbours. The sizes must be equal and not empty.
std::vector<float> ldrFlip(const ColourView& reference, const ColourView& test,
                           const FlipOptions& options = {});

/// HDR-FLIP: the largest LDR-FLIP over the exposures, with the ACES tone-mapping curve of
/// [Andersson2021]. Negative values count as 0.
std::vector<float> hdrFlip(const ColourView& reference, const ColourView& test,
                           const FlipOptions& options = {});

/// The colour of an error 0..1 in FLIP's maps: the magma colour map, as a polynomial.
std::array<std::uint8_t, 3> magma(float error);

}  // namespace catoptric::measure
