// Shades with Embree the samples that no virtual object covers (option `gaps`). Not in the paper,
// which shows the environment there.
#pragma once

#include <cstdint>
#include <span>

#include "methods/contract/method.h"
#include "methods/shared/reflective_samples.h"
#include "raster/gbuffer.h"
#include "scene/camera.h"
#include "trace/lobes/reflect.h"

namespace catoptric::methods::perturbation {

struct FilledGaps {
  std::uint64_t samples = 0;  ///< uncovered samples whose path hits a surface
  trace::ReflectionCounts rays;
};

/// Writes the radiance of the uncovered samples to GBuffer::reflection and, with `marks`,
/// kMaskRetraced to GBuffer::masks. `uncovered`: as for findDisocclusions(). `upload` keeps memory
/// from frame to frame.
FilledGaps fillGaps(const raster::GBufferCopy& gbuffer, const scene::Camera& camera,
                    std::span<const std::uint8_t> uncovered, const trace::ReflectionOptions& paths,
                    bool marks, Services& services, ReflectionUpload& upload);

}  // namespace catoptric::methods::perturbation
