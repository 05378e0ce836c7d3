// The resolution of each object's geometry image, from its possible size in reflections.
#pragma once

#include <cstdint>
#include <vector>

#include "methods/contract/method.h"
#include "methods/glossy_lod/images/geometry_image.h"
#include "methods/glossy_lod/options.h"

namespace catoptric::methods::glossy_lod {

/// Approximate size in bytes of images with these numbers of quads and texels.
std::uint64_t imageBytes(double quads, double texels);

struct Sizes {
  /// Indexed like the scene's objects; 0 quads: the object has no image.
  std::vector<ImageSize> ofObject;
  double quads = 0.0;  ///< approximate number over all objects
  double texels = 0.0;
  std::uint64_t bytes = 0;
  std::uint64_t reduced = 0;  ///< objects with coarser images than requested
};

/// With the option `size`, all objects have the same number of quads, with one texel each. Without
/// it, quads follow from an object's triangles, and texels from the pixels that its reflections can
/// cover, for the cameras of the run's path and the scene at the first frame. If all objects
/// together would need more than `memory_mib`, all images become coarser.
Sizes findSizes(const scene::Scene& scene, const RunSettings& settings, const Options& options);

}  // namespace catoptric::methods::glossy_lod
