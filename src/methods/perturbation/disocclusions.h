// Which samples show the environment because no virtual object covers them although there is a
// surface: Embree's rays tell. A diagnosis, not part of the method.
#pragma once

#include <cstdint>
#include <span>

#include "frame/shading.h"
#include "raster/gbuffer.h"
#include "scene/camera.h"
#include "trace/embree/trace_scene.h"

namespace catoptric::methods::perturbation {

/// How many of the uncovered samples are disoccluded; they get kMaskDisoccluded in `masks` (may be
/// empty). `uncovered`, one per sample: which of its reflections no virtual object covers, counted
/// from 1; 0: none. Where Embree's path ends before, it is not.
std::uint64_t findDisocclusions(const raster::GBufferCopy& gbuffer, const scene::Camera& camera,
                                std::span<const std::uint8_t> uncovered,
                                const frame::Lighting& lighting, const trace::TraceScene& trace,
                                std::span<std::uint16_t> masks);

}  // namespace catoptric::methods::perturbation
