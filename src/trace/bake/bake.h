// Bakes static light per vertex: ambient occlusion, and the irradiance of baked lights.
#pragma once

#include <filesystem>
#include <functional>

#include "frame/geometry.h"
#include "frame/shading.h"
#include "scene/scene.h"

namespace catoptric::trace {

struct BakeReport {
  bool fromCache = false;
  bool stopped =
      false;  ///< stopRequested() returned true: no vertex was changed, nothing was cached
  double seconds = 0.0;
  std::uint64_t rays = 0;
  std::uint64_t refused = 0;  ///< rays that Embree did not get; a warning was logged
  std::size_t points = 0;     ///< distinct (position, normal) pairs that were lit
  std::size_t enclosed =
      0;  ///< points that lie inside other geometry; they take the light of their neighbours
};

/// Both functions may be called by several threads, every few milliseconds.
struct BakeCallbacks {
  std::function<bool()> stopRequested;  ///< returns true to end the bake; no vertex is then changed
  std::function<void(double share)>
      progress;  ///< `share`: fraction of the rays that are done, 0..1
};

/// Fills VertexAttributes::bake of all vertices according to scene.bake; for BakeMode::None nothing
/// is done.
///   AmbientOcclusion: rgb is 0; a is the cosine-weighted fraction of the hemisphere without
///     geometry within ambientOcclusionDistance.
///   Full: a = 0 (or, with BakeSettings::skyApart, the share of the environment's irradiance that
///     arrives, and rgb is the rest); rgb is irradiance from four sources: the baked lights
///     (Light::radius determines how soft shadows are), emissive surfaces, the environment, and pi
///     * ambient * occlusion. Interreflection is included, with scene.bake's number of `bounces`.
/// Moving objects receive light at the pose of `geometry` but cast none. Back faces are black.
/// Mirrors count as diffuse surfaces here. Rays are also aimed at bright surfaces. Neighbours use
/// consecutive parts of one low-discrepancy sequence; their values are then smoothed along the
/// mesh, by their noise, and less near other surfaces. The result is the same for any thread count.
/// The result is cached in the folder `cache` (empty: not cached) under the scene's fingerprint. A
/// cache file that does not match or is damaged is replaced.
BakeReport bakeVertices(const scene::Scene& scene, frame::Geometry& geometry,
                        const frame::EnvironmentLight& environment,
                        const std::filesystem::path& cache, const BakeCallbacks& callbacks = {});

}  // namespace catoptric::trace
