// Levels of detail on disk: they take a second and more to make, and depend on the geometry, its
// mean colours and its light alone.
#pragma once

#include <filesystem>
#include <span>

#include "raster/scene_gpu/detail_levels.h"

namespace catoptric::raster {

/// As buildDetailLevels(), whose levels of the same geometry, sources and light are kept in
/// `cache`; empty: nowhere. A file that is damaged is made anew.
DetailLevels cachedDetailLevels(const frame::Geometry& geometry,
                                std::span<const LevelSource> sources,
                                const frame::Lighting& lighting,
                                const std::filesystem::path& cache);

}  // namespace catoptric::raster
