// FLIP: how strongly two images seem to differ when a viewer alternates between them, 0..1 in each
// pixel: LDR-FLIP [Andersson2020] and HDR-FLIP [Andersson2021]. Our own implementation; all of its
// 2D filters are sums of separable ones and are applied as such.
#pragma once

#include <array>
#include <vector>

#include "measure/colours.h"

namespace catoptric::measure {

struct FlipOptions {
  /// Pixels in a degree of the viewer's field: a screen 0.7 m wide of 3840 pixels, 0.7 m away.
  /// [Andersson2020] Sec. 5.1
  float pixelsPerDegree = 67.0206433f;
  /// HDR-FLIP's exposures, in stops; the same for all frames, so that they can be compared. The
  /// papers derive them from one reference image. Count: [Andersson2021] Sec. 4, one for each stop.
  float startExposure = -3.0f;
  float stopExposure = 3.0f;
  int exposures = 6;
};

/// LDR-FLIP of the values clamped to 0..1 (what an sRGB screen shows, before rounding to 8 bits).
/// Pixels that are not finite in either image have an error of 1, and count as black beside them.
/// Sizes must be equal and not empty.
std::vector<float> ldrFlip(const ColourView& reference, const ColourView& test,
                           const FlipOptions& options = {});

/// HDR-FLIP: the largest LDR-FLIP over the exposures, tone-mapped with the ACES curve of
/// [Andersson2021]. Negative values count as 0.
std::vector<float> hdrFlip(const ColourView& reference, const ColourView& test,
                           const FlipOptions& options = {});

/// The colour of an error 0..1 in FLIP's maps: magma, by a polynomial.
std::array<std::uint8_t, 3> magma(float error);

}  // namespace catoptric::measure
