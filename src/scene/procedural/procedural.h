// Procedural textures: made from integer hashes alone, so the same everywhere, and seamless where
// a pattern is meant to repeat. docs/scenes.md lists names and parameters.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "config/json.h"
#include "core/math.h"

namespace catoptric::scene {

/// A square picture, sRGB-encoded RGBA8, row 0 at the top, with the heights it implies.
struct ProceduralImage {
  int size = 0;
  std::vector<std::uint8_t> rgba;
  /// Heights in units of the tile's width, size x size; what "normal_map": "match" is made from.
  std::vector<float> height;
};

const std::vector<std::string>& proceduralNames();

/// The table of one procedural's parameters ("size", "seed", "colors" and its own); asserts that
/// the name exists.
const config::Schema& proceduralSchema(const std::string& name);

/// Makes the texture that `settings` describes: {"procedural": name, ...}. Throws UsageError with
/// the place of what is wrong.
ProceduralImage makeProcedural(const config::Value& settings);

/// Tangent-space normal map (x right, y up in the picture, z out; RGBA8, linear) of heights that
/// repeat; `strength` multiplies the slopes.
std::vector<std::uint8_t> normalMapFromHeight(const std::vector<float>& height, int size,
                                              float strength);

/// A colour of a description: [r, g, b] scene-linear, or "#rrggbb" in sRGB. Throws UsageError.
Vec3 colorOf(const config::Value& value);

}  // namespace catoptric::scene
