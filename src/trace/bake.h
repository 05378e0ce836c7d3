// Per-vertex light that does not change: ambient occlusion, irradiance of baked lights.
#pragma once

#include <filesystem>

#include "frame/geometry.h"
#include "frame/shading.h"
#include "scene/scene.h"

namespace catoptric::trace {

struct BakeReport {
  bool fromCache = false;
  double seconds = 0.0;
  std::uint64_t rays = 0;
};

/// Fills VertexAttributes::bake of all vertices as scene.bake asks (nothing for BakeMode::None).
/// Moving objects receive light at the pose of `geometry` but cast none. Low-discrepancy
/// directions, rotated per vertex by its number: the same result for any thread count. The result
/// is cached in `cache` (no caching when empty) under the scene's fingerprint.
BakeReport bakeVertices(const scene::Scene& scene, frame::Geometry& geometry,
                        const frame::EnvironmentLight& environment,
                        const std::filesystem::path& cache);

}  // namespace catoptric::trace
