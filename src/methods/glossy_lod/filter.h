// The radiance that a ray receives at a quad: the mean over its footprint [Yu2008, section 3.4].
#pragma once

#include <cstdint>

#include "core/math.h"
#include "methods/glossy_lod/radiance.h"
#include "methods/glossy_lod/scene_images.h"

namespace catoptric::methods::glossy_lod {

/// The hit of a ray on a quad.
struct QuadHit {
  std::uint32_t node = 0;
  Vec2 at{0.0f};      ///< position in the node's quad, 0..1
  bool back = false;  ///< the ray hits the back
};

/// Converts a position in a quad to one in its chart's square; both 0..1.
Vec2 placeInChart(const Quad& quad, const PlacedChart& chart, const Vec2& at);

/// The finest texel of a chart that contains a position in its square.
glm::uvec2 nearestTexel(const PlacedChart& chart, const Vec2& place);

/// Mip level whose texels have the size of the footprint of a ray that is `width` metres wide. The
/// size of texels is computed from the triangle that was hit. A texel's own area is that of the
/// finest triangle below it, so both agree there; on a coarse quad the footprint lies on the hit's
/// triangle, whose cosine Eq. (8) takes.
float levelOf(const SceneImages& images, const QuadHit& found, const Vec3& direction, float width);

/// The texels to average for a hit. Their memory is being prefetched.
struct Footprint {
  /// Four neighbouring texels of one level: one corner and the offsets of the others.
  struct Square {
    const Vec4* corner = nullptr;
    std::size_t right = 0, up = 0;
    Vec2 at{0.0f};  ///< position between them, 0..1; half a texel beyond at a chart's border
  };
  Square fine, coarse;
  float share = 0.0f;  ///< weight of the coarser level
};

/// The texels of the two levels around levelOf(). Without `filter`: the nearest texel.
Footprint footprint(const SceneImages& images, const Radiance& radiance, const QuadHit& found,
                    const Vec3& direction, float width, bool filter);
Vec3 mean(const Footprint& footprint);

/// isCutAway() is an AlphaTest::isCut whose first argument points to a SceneTexels.
struct SceneTexels {
  const SceneImages& images;
  const Radiance& radiance;
};
bool isCutAway(const void* sceneTexels, std::uint32_t node, Vec2 at);

}  // namespace catoptric::methods::glossy_lod
