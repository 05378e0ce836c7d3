// Converts samples of a G-buffer to points for tracing, in the same way for all methods.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/random.h"
#include "core/sampling.h"
#include "raster/gbuffer.h"
#include "scene/camera.h"
#include "trace/lobes/reflect.h"

namespace catoptric::methods {

/// ReflectionPoint::shift of sample (x, y), the same in every frame: the R2 sequence along the
/// Morton order of 8 x 8 samples. The rays of neighbouring samples thus fill each other's gaps:
/// within a pixel, 2 x 2 pixels, and 4 x 4 pixels. lobe_rays.glsl has the same numbers.
inline Vec2 lobeShift(int x, int y) {
  static const auto shifts = [] {
    std::array<Vec2, 64> table;
    for (unsigned at = 0; at < table.size(); ++at) {
      std::uint32_t place = 0;
      for (unsigned bit = 0; bit < 3; ++bit)
        place |= (at >> bit & 1u) << 2 * bit | (at >> (bit + 3) & 1u) << (2 * bit + 1);
      table[at] = {unitFloat(0x80000000u + place * kR2xBits),
                   unitFloat(0x80000000u + place * kR2yBits)};
    }
    return table;
  }();
  return shifts[static_cast<std::size_t>((y & 7) * 8 + (x & 7))];
}

class SamplePoints {
 public:
  /// Keeps references to `source` and `trace`.
  SamplePoints(const raster::GBufferCopy& source, const scene::Camera& camera,
               const trace::TraceScene& trace)
      : source_(source),
        trace_(trace),
        eye_(camera.eye()),
        nearMetres_(camera.nearMetres),
        rayFromPixel_(scene::rayFromPixel(camera, source.sampleWidth(), source.sampleHeight())) {}

  /// The point of sample (x, y), which must show an object.
  trace::ReflectionPoint operator()(int x, int y) const {
    const std::size_t at =
        static_cast<std::size_t>(y) * static_cast<std::size_t>(source_.sampleWidth()) +
        static_cast<std::size_t>(x);
    const Vec3 ray =
        rayFromPixel_ * Vec3(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f, 1.0f);
    const float scale = nearMetres_ / source_.depth[at];
    const float length = glm::length(ray);
    trace::ReflectionPoint point;
    point.position = eye_ + scale * ray;
    point.direction = ray / length;
    point.distance = scale * length;
    const float* normal = &source_.normal[4 * at];
    point.normal = Vec3(normal[0], normal[1], normal[2]);
    point.lobe = raster::lobeOf(normal[3]);
    point.bent = raster::isBent(normal[3]);
    if (!source_.lobeHorizon.empty())
      point.lobeHorizon = raster::lobeHorizonOf(source_.lobeHorizon[at], point.normal);
    point.object = static_cast<int>(source_.object[at]);
    point.extent = trace_.extentOf(point.object - 1);
    point.shift = lobeShift(x, y);
    return point;
  }

 private:
  const raster::GBufferCopy& source_;
  const trace::TraceScene& trace_;
  Vec3 eye_;
  float nearMetres_;
  Mat3 rayFromPixel_;
};

}  // namespace catoptric::methods
