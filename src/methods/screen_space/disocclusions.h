// Compares rays that were followed over the frame's depths with Embree's rays from the same
// samples: a diagnosis, not part of the method.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "raster/gbuffer.h"
#include "scene/camera.h"
#include "trace/embree/trace_scene.h"

namespace catoptric::methods::screen_space {

struct Disocclusions {
  std::uint64_t disoccluded = 0;  ///< rays that found nothing although Embree's hits a surface
  std::uint64_t missedHits = 0;   ///< of these, rays whose surface a layer of the frame shows
  std::uint64_t wrongHits = 0;    ///< rays with a hit that is not Embree's

  Disocclusions& operator+=(const Disocclusions& other) {
    disoccluded += other.disoccluded;
    missedHits += other.missedHits;
    wrongHits += other.wrongHits;
    return *this;
  }
};

/// The rays of a frame, as reflect.frag has followed them.
struct FollowedRays {
  /// How they ended, as reflect.frag stores it: one per sample for each ray of a lobe, all first
  /// rays first. 0: the sample has no such ray.
  std::vector<std::uint32_t> ends;
  int rays = 1;       ///< per lobe
  bool cone = false;  ///< lobes have a single ray, in their rays' mean direction
  std::vector<std::uint32_t> secondObject = {};  ///< of the second layer; empty: there is none
  std::vector<float> secondDepth = {};
};

/// Samples with a ray that is disoccluded or hits wrongly get kMaskDisoccluded in `masks` (may be
/// empty).
Disocclusions findDisocclusions(const raster::GBufferCopy& gbuffer, const scene::Camera& camera,
                                const FollowedRays& followed, const trace::TraceScene& trace,
                                std::span<std::uint16_t> masks);

}  // namespace catoptric::methods::screen_space
