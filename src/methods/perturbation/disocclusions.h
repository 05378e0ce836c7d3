// Finds, with Embree, the samples that show the environment because no virtual object covers them
// although there is a surface. A diagnosis, not part of the method.
#pragma once

#include <cstdint>
#include <span>

#include "frame/shading.h"
#include "raster/gbuffer.h"
#include "scene/camera.h"
#include "trace/embree/trace_scene.h"

namespace catoptric::methods::perturbation {

/// Counts the uncovered samples that are disoccluded; they get kMaskDisoccluded in `masks` (may be
/// empty). `uncovered`: for each sample, the number (from 1) of the reflection that no virtual
/// object covers; 0: all are covered. A sample is not disoccluded if Embree's path ends before that
/// reflection.
std::uint64_t findDisocclusions(const raster::GBufferCopy& gbuffer, const scene::Camera& camera,
                                std::span<const std::uint8_t> uncovered,
                                const frame::Lighting& lighting, const trace::TraceScene& trace,
                                std::span<std::uint16_t> masks);

}  // namespace catoptric::methods::perturbation
