// Geometry images kept on disk.
#pragma once

#include <filesystem>

#include "methods/glossy_lod/images/geometry_image.h"

namespace catoptric::methods::glossy_lod {

/// As makeObjectImage(), from the cache where it has what was made of the same mesh with the same
/// numbers. Small meshes are not cached. `folder` empty: nothing is.
ObjectImage cachedObjectImage(const MeshView& mesh, double quads, int size,
                              const std::filesystem::path& folder);

}  // namespace catoptric::methods::glossy_lod
