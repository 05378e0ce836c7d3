// The three colour channels of an image, whatever their names.
#pragma once

#include <array>
#include <string>

#include "image/image.h"

namespace catoptric::measure {

/// The scene-linear Rec.709 colours of an image: the image and the indices of its R, G, B.
struct ColourView {
  const image::Image* image = nullptr;
  std::array<int, 3> channels{};
};

/// The indices of R, G, B; otherwise of r, g, b; otherwise of the colours of the only layer that
/// has colours; otherwise Y three times. Throws UsageError, which begins with `name`.
std::array<int, 3> colourChannels(const image::Image& image, const std::string& name);

/// The layer LAYER.R, .G, .B of an image; without it the image is null and the indices are -1.
ColourView layerColours(const image::Image& image, const std::string& layer);

/// Throws UsageError if the sizes differ.
void requireSameSize(const image::Image& image, const image::Image& reference,
                     const std::string& name);

}  // namespace catoptric::measure
