// The frame in bands: while one band is traced, the next is read from the device and the last goes
// back. Nothing is as large as the frame.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/parallel.h"
#include "frame/object_set.h"
#include "frame/steps.h"
#include "methods/shared/sample_tiles.h"
#include "raster/gbuffer.h"
#include "scene/camera.h"
#include "trace/embree/trace_scene.h"
#include "trace/lobes/reflect.h"

namespace catoptric::methods {

/// One frame's task.
struct TracedFrame {
  raster::GBuffer& gbuffer;
  const scene::Camera& camera;
  const trace::TraceScene& trace;
  const frame::Lighting& lighting;
  frame::StepTimer& timer;
  const frame::ObjectSet& own;  ///< reflectors to fill; samples of others stay
  const trace::ReflectionOptions& reflection;
  bool masks;
};

class TracedBands {
 public:
  /// Fills GBuffer::reflection (and masks) of the reflective samples. Adds the steps readback,
  /// trace, resolve and upload: those of the device as they took on the calling thread, the rest of
  /// the time shared between the other two as all threads spent it.
  trace::ReflectionCounts run(const TracedFrame& frame);

  /// Samples of a band of a frame of so many samples a row, at most.
  static std::uint64_t largest(int sampleWidth);

 private:
  struct Band {
    raster::GBufferCopy samples;
    std::vector<float> image;  ///< 4 a sample
    std::vector<std::uint16_t> masks;
  };
  void read(const TracedFrame& frame, int firstRow, int rows, Band& band) const;
  static void upload(const TracedFrame& frame, const Band& band);
  static trace::ReflectionCounts traceBand(const TracedFrame& frame, const SampleTiles& tiles,
                                           Band& band);

  bool readsLevels_ = false;
  std::array<Band, 2> bands_;  ///< in turns
};

}  // namespace catoptric::methods
