// The faces of a cube map.
#pragma once

#include <array>

#include "core/math.h"

namespace catoptric::raster {

/// Directions to the right and down in a face's image, and towards its middle.
struct CubeFace {
  Vec3 right, down, forward;
};
/// In the order of GL.
inline constexpr std::array<CubeFace, 6> kCubeFaces = {{{{0, 0, -1}, {0, -1, 0}, {1, 0, 0}},
                                                        {{0, 0, 1}, {0, -1, 0}, {-1, 0, 0}},
                                                        {{1, 0, 0}, {0, 0, 1}, {0, 1, 0}},
                                                        {{1, 0, 0}, {0, 0, -1}, {0, -1, 0}},
                                                        {{1, 0, 0}, {0, -1, 0}, {0, 0, 1}},
                                                        {{-1, 0, 0}, {0, -1, 0}, {0, 0, -1}}}};

}  // namespace catoptric::raster
