// Traces reflections on the CPU in bands of the frame: while one band is traced, the next is read
// from the GPU and the previous one is uploaded. No buffer is as large as the frame.
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

/// The inputs for one frame.
struct BandFrame {
  raster::GBuffer& gbuffer;
  const SampleTiles& tiles;
  frame::StepTimer& timer;
  const scene::Scene& scene;
  const frame::ObjectSet& own;  ///< reflectors to shade; samples of others are not changed
  bool masks;
  std::uint16_t mark = 0;  ///< bits of raster::MaskBit that every sample gets, besides its flags
  /// R8UI by sample: only samples with 1 are shaded, and keep their bits of masks. Null: all.
  const gl::Texture* only = nullptr;
};

/// Traces a tile in the calling thread: sets radiance[i] of the tile's member i, and, if masks are
/// requested, flags[i] as trace::reflectedRadiance() does.
using TraceTile =
    std::function<void(const raster::GBufferCopy& samples, const SampleTiles::Members& members,
                       Vec3* radiance, std::uint8_t* flags)>;

class Bands {
 public:
  /// Sets GBuffer::reflection (and masks) of the reflective samples. Adds the steps readback and
  /// upload, as timed in the calling thread; returns the remaining time in seconds.
  double run(const BandFrame& frame, const TraceTile& traceTile);

  /// Maximum number of samples in a band, for this many samples per row.
  static std::uint64_t largest(int sampleWidth);

 private:
  struct Band {
    raster::GBufferCopy samples;
    std::vector<float> image;  ///< 4 values per sample
    std::vector<std::uint16_t> masks;
    std::vector<std::uint8_t> only;
  };
  void read(const BandFrame& frame, int firstRow, int rows, Band& band) const;
  static void upload(const BandFrame& frame, const Band& band);
  static void traceBand(const BandFrame& frame, const TraceTile& traceTile, Band& band);

  bool readsLevels_ = false;
  std::array<Band, 2> bands_;  ///< used alternately
};

}  // namespace catoptric::methods
