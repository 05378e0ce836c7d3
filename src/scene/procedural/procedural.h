// Procedural textures. They are computed from integer hashes alone, so they are the same on every
// machine. Patterns that should repeat are seamless. docs/scenes.md lists names and parameters.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "config/json.h"
#include "core/math.h"

namespace catoptric::scene {

/// A square picture, sRGB-encoded RGBA8, row 0 at the top, and its height field.
struct ProceduralImage {
  int size = 0;
  std::vector<std::uint8_t> rgba;
  /// Heights in units of the tile's width, size x size. "normal_map": "match" is computed from
  /// them.
  std::vector<float> height;
};

const std::vector<std::string>& proceduralNames();

/// The schema of one texture's parameters ("size", "seed", "colors" and its own). Asserts that the
/// name exists.
const config::Schema& proceduralSchema(const std::string& name);

/// Makes the texture that `settings` describes: {"procedural": name, ...}. Throws UsageError with
/// the place of the error.
ProceduralImage makeProcedural(const config::Value& settings);

/// The tangent-space normal map of a height field that repeats (x right, y up in the picture, z
/// out; RGBA8, linear). `strength` multiplies the slopes.
std::vector<std::uint8_t> normalMapFromHeight(const std::vector<float>& height, int size,
                                              float strength);

/// A colour of a description: scene-linear [r, g, b], or "#rrggbb" in sRGB. Throws UsageError.
Vec3 colorOf(const config::Value& value);

}  // namespace catoptric::scene
