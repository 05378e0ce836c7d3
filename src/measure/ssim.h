// Structural similarity [Wang2004].
#pragma once

#include <span>
#include <vector>

namespace catoptric::measure {

/// Mean structural similarity of two grey images with a dynamic range of 1: Gaussian window of 11
/// and sigma 1.5, cut at the borders. [Wang2004] Eq. (13)
double ssim(std::span<const float> a, std::span<const float> b, int width, int height);
/// The same, of every pixel's window.
std::vector<double> ssimMap(std::span<const float> a, std::span<const float> b, int width,
                            int height);

}  // namespace catoptric::measure
