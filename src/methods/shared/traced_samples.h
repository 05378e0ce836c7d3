// Traces the reflective samples of a frame with Embree.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "methods/contract/method.h"
#include "methods/shared/bands.h"
#include "trace/lobes/reflect.h"

namespace catoptric::methods {

/// What a plan says of traceSamples() for the samples that `which` names (TracedPart::only).
std::vector<PlanItem> tracedItems(const RunSettings& settings, const std::string& which);

struct TracedPart {
  const trace::TraceScene& trace;
  const trace::ReflectionOptions& options;
  const frame::ObjectSet& own;  ///< the reflectors whose samples are traced
  bool masks = false;
  std::uint16_t mark = 0;             ///< BandFrame::mark
  const gl::Texture* only = nullptr;  ///< BandFrame::only
};

struct TracedCounts : trace::ReflectionCounts {
  std::uint64_t samples = 0;
};

/// Sets GBuffer::reflection (and masks) of the samples. Timed as the steps readback, trace, resolve
/// and upload.
TracedCounts traceSamples(const TracedPart& samples, const scene::Camera& camera,
                          Services& services, Bands& bands);

}  // namespace catoptric::methods
