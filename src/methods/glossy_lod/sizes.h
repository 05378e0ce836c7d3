// How fine the image of each object is, by what the reflectors can show of it.
#pragma once

#include <cstdint>
#include <vector>

#include "methods/contract/method.h"
#include "methods/glossy_lod/images/geometry_image.h"
#include "methods/glossy_lod/options.h"

namespace catoptric::methods::glossy_lod {

struct Sizes {
  std::vector<ImageSize> ofObject;  ///< by index in the scene; without quads: it has no image
  double quads = 0.0;               ///< of all objects, about
  double texels = 0.0;
  std::uint64_t bytes = 0;
  std::uint64_t reduced = 0;  ///< objects that have fewer than they ask for
};

/// With the option `size` as many quads for each object, and a texel for each. Without it quads by
/// its triangles and texels by the pixels that it can cover in reflectors, from the cameras of the
/// run's path (in the scene as it is at its first frame): coarser where all together would need
/// more memory than `memory_mib`.
Sizes findSizes(const scene::Scene& scene, const RunSettings& settings, const Options& options);

}  // namespace catoptric::methods::glossy_lod
