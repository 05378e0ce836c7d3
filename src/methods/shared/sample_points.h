// Samples of a G-buffer as points to trace from: one definition for all methods.
#pragma once

#include <cstddef>

#include "raster/gbuffer.h"
#include "scene/camera.h"
#include "trace/lobes/reflect.h"

namespace catoptric::methods {

/// ReflectionPoint::shift at a place of a pixel of samples x samples: lobes of the samples of one
/// pixel are shifted against each other, the same way in every pixel and frame.
inline Vec2 lobeShift(int cell, int samples) {
  const auto cells = static_cast<float>(samples * samples);
  return {(static_cast<float>(cell) + 0.5f) / cells,
          glm::fract(static_cast<float>(cell) * 0.6180340f)};
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

  /// That of sample (x, y), which shows an object.
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
    point.shift =
        lobeShift((y % source_.samples) * source_.samples + x % source_.samples, source_.samples);
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
