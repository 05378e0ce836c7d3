// The faces of a cube map.
#pragma once

#include <array>

#include "core/math.h"

namespace catoptric::raster {

/// The right and down directions of a face's image, and the direction from the cube's centre to the
/// face's centre.
struct CubeFace {
  Vec3 right, down, forward;
};
/// In the order of OpenGL's cube map faces.
inline constexpr std::array<CubeFace, 6> kCubeFaces = {{{{0, 0, -1}, {0, -1, 0}, {1, 0, 0}},
                                                        {{0, 0, 1}, {0, -1, 0}, {-1, 0, 0}},
                                                        {{1, 0, 0}, {0, 0, 1}, {0, 1, 0}},
                                                        {{1, 0, 0}, {0, 0, -1}, {0, -1, 0}},
                                                        {{1, 0, 0}, {0, -1, 0}, {0, 0, 1}},
                                                        {{-1, 0, 0}, {0, -1, 0}, {0, 0, -1}}}};

}  // namespace catoptric::raster
