// Stores levels of detail on disk, because they take a second or more to build. They depend only on
// the geometry, its mean colours and its light.
#pragma once

#include <filesystem>
#include <span>

#include "raster/scene_gpu/detail_levels.h"

namespace catoptric::raster {

/// As buildDetailLevels(), but reads the levels from `cache` if it holds those of the same
/// geometry, sources and light, and stores them there otherwise. An empty `cache` disables this. A
/// damaged file is replaced.
DetailLevels cachedDetailLevels(const frame::Geometry& geometry,
                                std::span<const LevelSource> sources,
                                const frame::Lighting& lighting,
                                const std::filesystem::path& cache);

}  // namespace catoptric::raster
