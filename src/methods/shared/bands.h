// Reflections that are traced on the CPU, the frame in bands: while one band is traced, the next is
// read from the device and the last goes back. Nothing is as large as the frame.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "frame/object_set.h"
#include "frame/steps.h"
#include "methods/shared/sample_tiles.h"
#include "raster/gbuffer.h"

namespace catoptric::methods {

/// One frame's task.
struct BandFrame {
  raster::GBuffer& gbuffer;
  const SampleTiles& tiles;
  frame::StepTimer& timer;
  const scene::Scene& scene;
  const frame::ObjectSet& own;  ///< reflectors to fill; samples of others stay
  bool masks;
};

/// Traces a tile on the calling thread: radiance[i], and where masks are asked for flags[i] of
/// trace::reflectedRadiance(), of the tile's member i.
using TraceTile =
    std::function<void(const raster::GBufferCopy& samples, const SampleTiles::Members& members,
                       Vec3* radiance, std::uint8_t* flags)>;

class Bands {
 public:
  /// Fills GBuffer::reflection (and masks) of the reflective samples. Adds the steps readback and
  /// upload, those of the device as they took on the calling thread; returns the rest of the time,
  /// in seconds.
  double run(const BandFrame& frame, const TraceTile& traceTile);

  /// Samples of a band of a frame of so many samples a row, at most.
  static std::uint64_t largest(int sampleWidth);

 private:
  struct Band {
    raster::GBufferCopy samples;
    std::vector<float> image;  ///< 4 a sample
    std::vector<std::uint16_t> masks;
  };
  void read(const BandFrame& frame, int firstRow, int rows, Band& band) const;
  static void upload(const BandFrame& frame, const Band& band);
  static void traceBand(const BandFrame& frame, const TraceTile& traceTile, Band& band);

  bool readsLevels_ = false;
  std::array<Band, 2> bands_;  ///< in turns
};

}  // namespace catoptric::methods
