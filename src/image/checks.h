// Checks of images; for the sources of this folder only.
#pragma once

#include <string>

#include "image/image.h"

namespace catoptric::image {

/// "64 x 48 pixels of 4 channels"
std::string describe(const Image& image);
/// Throws OutputError unless there are pixels, as many values as channels want, and names that
/// differ.
void requireWellFormed(const Image& image);

}  // namespace catoptric::image
