// Structural similarity [Wang2004].
#pragma once

#include <span>
#include <vector>

namespace catoptric::measure {

/// Mean structural similarity of two grey images with a dynamic range of 1. The Gaussian window has
/// 11 x 11 pixels and sigma 1.5, and is cut off at the image's borders. [Wang2004] Eq. (13)
double ssim(std::span<const float> a, std::span<const float> b, int width, int height);
/// The structural similarity of every pixel's window.
std::vector<double> ssimMap(std::span<const float> a, std::span<const float> b, int width,
                            int height);

}  // namespace catoptric::measure
