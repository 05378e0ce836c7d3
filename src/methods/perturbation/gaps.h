// What samples show that no virtual object covers, where the option `gaps` asks for it: Embree's
// paths. Beyond the paper, which leaves the environment there.
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
  std::uint64_t samples = 0;  ///< of uncovered ones: see a surface
  trace::ReflectionCounts rays;
};

/// Writes what the uncovered samples see to GBuffer::reflection and, with `marks`, their
/// kMaskRetraced to GBuffer::masks. `uncovered`, one per sample: as for findDisocclusions().
/// `upload` keeps memory from frame to frame.
FilledGaps fillGaps(const raster::GBufferCopy& gbuffer, const scene::Camera& camera,
                    std::span<const std::uint8_t> uncovered, const trace::ReflectionOptions& paths,
                    bool marks, Services& services, ReflectionUpload& upload);

}  // namespace catoptric::methods::perturbation
