// Checks of images; private to this folder.
#pragma once

#include <string>

#include "image/image.h"

namespace catoptric::image {

/// For example "64 x 48 pixels of 4 channels".
std::string describe(const Image& image);
/// Throws OutputError unless the image has pixels, the right number of values, distinct channels.
void requireWellFormed(const Image& image);

}  // namespace catoptric::image
