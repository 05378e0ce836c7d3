// Which rays found nothing in their cluster's depth image where there is a surface, and which found
// another surface: Embree's rays from the same samples tell. A diagnosis, not part of the method.
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

/// What the rays of a sample found, as rays.frag writes it (std430).
struct FoundByRays {
  std::array<std::uint32_t, 2> nothing{};  ///< bit k: ray k found no surface
  /// Texel and depth that the only ray found in its cluster's image; depth 0: not known.
  std::array<float, 3> at{};
};

struct Disocclusions {
  std::uint64_t samples = 0;    ///< some ray found nothing where Embree's ray hits
  std::uint64_t wrongHits = 0;  ///< the only ray found a surface, Embree's another one or none

  Disocclusions& operator+=(const Disocclusions& other) {
    samples += other.samples;
    wrongHits += other.wrongHits;
    return *this;
  }
};

/// Traces the rays in question. `found`, `clusterOf` (as Clustering::clusterOf): one per sample of
/// the G-buffer; `rays`: per glossy sample.
/// Samples that are disoccluded get kMaskDisoccluded in `masks` (may be empty).
Disocclusions findDisocclusions(const raster::GBufferCopy& gbuffer, const scene::Camera& camera,
                                std::span<const FoundByRays> found,
                                std::span<const std::uint16_t> clusterOf,
                                std::span<const ClusterCamera> cameras, int rays,
                                const trace::TraceScene& trace, std::span<std::uint16_t> masks);

}  // namespace catoptric::methods::second_order
