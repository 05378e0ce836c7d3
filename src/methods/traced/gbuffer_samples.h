// Reflective samples of a G-buffer as points to trace from, in an order that keeps rays coherent.
#pragma once

#include <cstdint>
#include <vector>

#include "raster/gbuffer.h"
#include "scene/camera.h"
#include "trace/reflect.h"

namespace catoptric::methods {

/// What is read back of a G-buffer; row 0 on top, sampleWidth x sampleHeight.
struct GBufferCopy {
  int width = 0;  ///< of the frame, pixels
  int height = 0;
  int samples = 1;
  std::vector<float> diffuse;  ///< 4 a sample: rgb, s
  std::vector<float> normal;   ///< 4 a sample: xyz, g
  std::vector<std::uint32_t> object;
  std::vector<float> depth;  ///< reversed-Z
};

struct ReflectiveSamples {
  std::vector<trace::ReflectionPoint> points;
  std::vector<std::uint32_t> places;  ///< index of the sample in the G-buffer
};

/// World-space position of sample (x, y) with reversed-Z depth; `direction` is the unit vector
/// from the eye to it.
Vec3 samplePosition(const scene::Camera& camera, int sampleWidth, int sampleHeight, int x, int y,
                    float depth, Vec3& direction);

/// All samples with s > 0 on an object, tile by tile (16 x 16 samples), within a tile by object,
/// within an object along rows of 4 x 2 blocks. Lobes of the samples of one pixel are shifted
/// against each other, the same way in every pixel and frame.
ReflectiveSamples collectReflective(const GBufferCopy& source, const scene::Camera& camera);

}  // namespace catoptric::methods
