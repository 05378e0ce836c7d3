// Compares rays in depth images with Embree's rays from the same samples: finds missed and wrong
// hits. A diagnosis, not part of the method.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/math.h"
#include "methods/second_order/cameras/cluster_camera.h"
#include "raster/gbuffer.h"
#include "scene/camera.h"
#include "trace/embree/trace_scene.h"

namespace catoptric::methods::second_order {

/// The hits of a sample's rays, as rays.frag writes them (std430).
struct FoundByRays {
  std::array<std::uint32_t, 2> nothing{};  ///< bit k: ray k hit nothing
  /// Texel and depth of the hit in the cluster's image, for samples with a single ray; 0: unknown.
  std::array<float, 3> at{};
};

struct Disocclusions {
  /// Samples with a ray that hit nothing although Embree's ray hits a surface.
  std::uint64_t samples = 0;
  /// Samples whose single ray hit a surface that Embree's ray does not hit.
  std::uint64_t wrongHits = 0;

  Disocclusions& operator+=(const Disocclusions& other) {
    samples += other.samples;
    wrongHits += other.wrongHits;
    return *this;
  }
};

/// Traces the rays to be checked. `found`, `clusterOf` (as Clustering::clusterOf): one per sample
/// of the G-buffer; `rays`: number of rays per glossy sample. Disoccluded samples get
/// kMaskDisoccluded in `masks` (may be empty).
Disocclusions findDisocclusions(const raster::GBufferCopy& gbuffer, const scene::Camera& camera,
                                std::span<const FoundByRays> found,
                                std::span<const std::uint16_t> clusterOf,
                                std::span<const ClusterCamera> cameras, int rays,
                                const trace::TraceScene& trace, std::span<std::uint16_t> masks);

}  // namespace catoptric::methods::second_order
