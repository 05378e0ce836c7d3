// Compares rays that were followed over the frame's depths with Embree's rays from the same
// samples: a diagnosis, not part of the method.
#pragma once

#include <cstdint>
#include <span>

#include "raster/gbuffer.h"
#include "scene/camera.h"
#include "trace/embree/trace_scene.h"

namespace catoptric::methods::screen_space {

struct Disocclusions {
  std::uint64_t disoccluded = 0;  ///< rays that found nothing although Embree's hits a surface
  std::uint64_t missedHits = 0;   ///< of these, rays whose surface the frame shows
  std::uint64_t wrongHits = 0;    ///< rays with a hit that is not Embree's

  Disocclusions& operator+=(const Disocclusions& other) {
    disoccluded += other.disoccluded;
    missedHits += other.missedHits;
    wrongHits += other.wrongHits;
    return *this;
  }
};

/// `ends`: one per sample, as reflect.frag stores them; 0: the sample has no single ray. Samples
/// that are disoccluded or hit wrongly get kMaskDisoccluded in `masks` (may be empty).
Disocclusions findDisocclusions(const raster::GBufferCopy& gbuffer, const scene::Camera& camera,
                                std::span<const std::uint32_t> ends, const trace::TraceScene& trace,
                                std::span<std::uint16_t> masks);

}  // namespace catoptric::methods::screen_space
