// Mip chains, which GL and the CPU both sample.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "scene/scene.h"

namespace catoptric::scene {

/// The number of levels of a full chain down to 1 x 1. Each level has half the size of the one
/// before, rounded down.
int mipLevelCount(int width, int height);

/// Size in bytes of a full chain of RGBA8 levels.
std::size_t mipChainBytes(int width, int height);

/// The mip chain of an image (RGBA8, row 0 at the top). Every texel is the area-weighted mean of
/// the linear values that it covers, computed from the unrounded values of the next larger level.
/// `srgb`: red, green and blue are decoded first, and encoded again with rounding to nearest. This
/// is exact for odd sizes too: a texel of the larger level that overlaps two texels is divided
/// between them. The bytes are the same for any number of threads.
std::vector<MipLevel> makeMipChain(int width, int height, std::vector<std::uint8_t> rgba,
                                   bool srgb);

}  // namespace catoptric::scene
