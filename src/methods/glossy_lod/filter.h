// What a ray sees where it has met a quad: the mean radiance over what it stands for
// [Yu2008, section 3.4].
#pragma once

#include <cstdint>

#include "core/math.h"
#include "methods/glossy_lod/radiance.h"
#include "methods/glossy_lod/scene_images.h"

namespace catoptric::methods::glossy_lod {

/// Where a ray has met something.
struct QuadHit {
  std::uint32_t node = 0;
  Vec2 at{0.0f};      ///< in the node's quad, 0..1
  bool back = false;  ///< it meets the quad's back
};

/// The place in its chart's square, 0..1, of one in a quad.
Vec2 placeInChart(const Quad& quad, const PlacedChart& chart, const Vec2& at);

/// Of a chart's finest texels the one that holds a place in its square.
glm::uvec2 nearestTexel(const PlacedChart& chart, const Vec2& place);

/// Mip level at which a texel is as large as the footprint of a ray that is `width` metres wide;
/// the size of texels is that of the triangle which it met.
float levelOf(const SceneImages& images, const QuadHit& found, const Vec3& direction, float width);

/// The texels whose mean a ray sees, which are being loaded.
struct Footprint {
  /// On two levels, their texel of least x and y, and where the others lie from there.
  struct Square {
    const Vec4* corner = nullptr;
    std::size_t right = 0, up = 0;
    Vec2 at{0.0f};  ///< between them, 0..1
  };
  Square fine, coarse;
  float share = 0.0f;  ///< of the coarse level
};

/// Those of the levels next to levelOf(); without `filter` the nearest texel.
Footprint footprint(const SceneImages& images, const Radiance& radiance, const QuadHit& found,
                    const Vec3& direction, float width, bool filter);
Vec3 mean(const Footprint& footprint);

/// AlphaTest::isCut of a SceneTexels.
struct SceneTexels {
  const SceneImages& images;
  const Radiance& radiance;
};
bool isCutAway(const void* sceneTexels, std::uint32_t node, Vec2 at);

}  // namespace catoptric::methods::glossy_lod
