// Reflective samples of a G-buffer as points to trace from, in an order that keeps rays coherent.
#pragma once

#include <cstdint>
#include <vector>

#include "raster/gbuffer.h"
#include "scene/camera.h"
#include "trace/lobes/reflect.h"

namespace catoptric::methods {

struct ReflectiveSamples {
  std::vector<trace::ReflectionPoint> points;
  std::vector<std::uint32_t> places;  ///< index of the sample in the G-buffer
};

/// All samples with s > 0 on an object, tile by tile (16 x 16 samples), within a tile by object,
/// within an object along rows of 4 x 2 blocks.
ReflectiveSamples collectReflective(const raster::GBufferCopy& source, const scene::Camera& camera,
                                    const trace::TraceScene& trace);

}  // namespace catoptric::methods
