// Per-vertex light that does not change: ambient occlusion, irradiance of baked lights.
#pragma once

#include <filesystem>
#include <functional>

#include "frame/geometry.h"
#include "frame/shading.h"
#include "scene/scene.h"

namespace catoptric::trace {

struct BakeReport {
  bool fromCache = false;
  bool stopped = false;  ///< stopRequested() said so: nothing was filled in, nothing cached
  double seconds = 0.0;
  std::uint64_t rays = 0;
  std::uint64_t refused = 0;  ///< of them; a warning says so
  std::size_t points = 0;     ///< distinct (position, normal) pairs that were lit
  std::size_t enclosed = 0;   ///< of them inside other geometry: their light comes from neighbours
};

/// Both may be called by several threads, every few milliseconds.
struct BakeCallbacks {
  std::function<bool()> stopRequested;         ///< true: the bake ends, with nothing filled in
  std::function<void(double share)> progress;  ///< share of the rays that are done, 0..1
};

/// Fills VertexAttributes::bake of all vertices as scene.bake asks (nothing for BakeMode::None):
///   AmbientOcclusion: rgb 0, a = cosine-weighted share of the hemisphere that is free within
///     ambientOcclusionDistance;
///   Full: a = 0, rgb = irradiance of the baked lights (shadows as soft as Light::radius), of
///     emissive surfaces, of the environment and of pi * ambient * occlusion, after `bounces`
///     gathers of interreflection.
/// Moving objects receive light at the pose of `geometry` but cast none. Back faces are dark;
/// mirrors reflect diffusely here. Low-discrepancy directions, shifted per point by its number,
/// then smoothed along the mesh where neighbours differ by less than the noise: the same result for
/// any thread count. The result is cached in `cache` (no caching when empty) under the scene's
/// fingerprint; a cache file that does not fit or is damaged is made anew.
BakeReport bakeVertices(const scene::Scene& scene, frame::Geometry& geometry,
                        const frame::EnvironmentLight& environment,
                        const std::filesystem::path& cache, const BakeCallbacks& callbacks = {});

}  // namespace catoptric::trace
