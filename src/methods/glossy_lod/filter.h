// What a ray sees where it has met a quad: the mean radiance over what it stands for
// [Yu2008, section 3.4].
#pragma once

#include <cstdint>

#include "core/math.h"
#include "methods/glossy_lod/radiance.h"
#include "methods/glossy_lod/scene_images.h"

namespace catoptric::methods::glossy_lod {

/// Where a ray has met something.
struct Found {
  std::uint32_t node = 0;
  Vec2 at{0.0f};      ///< in the node's quad, 0..1
  bool back = false;  ///< it meets the quad's back
};

/// Mip level at which a texel is as large as the footprint of a ray that is `width` metres wide.
float levelOf(const SceneImages& images, const Radiance& radiance, const Found& found,
              const Vec3& direction, float width);

/// Radiance averaged over that footprint; without `filter` that of the nearest texel.
Vec3 seen(const SceneImages& images, const Radiance& radiance, const Found& found,
          const Vec3& direction, float width, bool filter);

/// AlphaTest::isCut of a SceneTexels.
struct SceneTexels {
  const SceneImages& images;
  const Radiance& radiance;
};
bool isCutAway(const void* sceneTexels, std::uint32_t node, Vec2 at);

}  // namespace catoptric::methods::glossy_lod
