// Caches geometry images on disk.
#pragma once

#include <filesystem>

#include "methods/glossy_lod/images/geometry_image.h"

namespace catoptric::methods::glossy_lod {

/// As makeObjectImage(), but reads the result from the cache if it contains one for the same mesh
/// and parameters. Small meshes are not cached. With an empty `folder` nothing is cached.
ObjectImage cachedObjectImage(const MeshView& mesh, const ImageSize& size,
                              const std::filesystem::path& folder);

}  // namespace catoptric::methods::glossy_lod
