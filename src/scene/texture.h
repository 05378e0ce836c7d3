// Mip chains: what GL and the CPU both sample.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "scene/scene.h"

namespace catoptric::scene {

/// Number of levels of a full chain down to 1 x 1; each level has half the size, rounded down.
int mipLevelCount(int width, int height);

/// Bytes of a full chain of RGBA8 levels.
std::size_t mipChainBytes(int width, int height);

/// The chain of an image (row 0 at the top, RGBA8): every texel is the area mean of the linear
/// values it covers, computed from unrounded values of the level below; `srgb` decodes red, green
/// and blue first and encodes them again, rounding to nearest. Exact for odd sizes too: a texel
/// that lies across two is divided. The same bytes for any number of threads.
std::vector<MipLevel> makeMipChain(int width, int height, std::vector<std::uint8_t> rgba,
                                   bool srgb);

}  // namespace catoptric::scene
