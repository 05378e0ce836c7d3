// The three colours of an image, whatever its channels are called.
#pragma once

#include <array>
#include <string>

#include "image/image.h"

namespace catoptric::measure {

/// Scene-linear Rec.709 colours: an image and the indices of its R, G, B.
struct ColourView {
  const image::Image* image = nullptr;
  std::array<int, 3> channels{};
};

/// Indices of R, G, B; or of r, g, b; or of the colours of the only layer that has some; or of Y
/// three times. Throws UsageError, which begins with `name`.
std::array<int, 3> colourChannels(const image::Image& image, const std::string& name);

/// Throws UsageError when sizes differ.
void requireSameSize(const image::Image& image, const image::Image& reference,
                     const std::string& name);

}  // namespace catoptric::measure
