// A joint bilateral filter [Petschnigg2004] over neighbouring samples' reflections, for few rays a
// lobe: 4 x 4 samples share out the directions of a lobe [Keller2001], and the filter joins them as
// far as their lobes overlap. Ours.
#pragma once

#include <cstdint>
#include <vector>

#include "methods/shared/sample_tiles.h"
#include "raster/gbuffer.h"
#include "trace/lobes/point_lanes.h"

namespace catoptric::methods::glossy_lod {

class Bilateral {
 public:
  /// Of a frame of so many samples.
  void begin(int width, int height);

  /// Turns the lobes of a tile's points against their neighbours'.
  static void interleave(const SampleTiles::Members& members, trace::PointLanes& points);

  /// Keeps what guides the filter, of points whose rays were made. `nearness`: the mean over a
  /// point's rays of 1 / metres to what they met, 0 where that is nothing.
  void keep(const SampleTiles::Members& members, const trace::PointLanes& points,
            const float* nearness);

  /// Filters GBuffer::reflection of the samples that were kept, of so many rays each; returns how
  /// many had neighbours.
  std::uint64_t run(raster::GBuffer& gbuffer, int rays);

 private:
  struct Sums;
  void addNeighbours(int row, int dx, int dy, Sums& sums) const;
  /// Writes a row's means; returns how many samples had neighbours.
  std::uint64_t writeRow(int row, const Sums& sums);

  int width_ = 0;
  int height_ = 0;
  float overlap_ = 0.0f;
  // By sample, row by row
  std::vector<float> position_[3];
  std::vector<float> axis_[3];  ///< of the lobe, unit length
  std::vector<float> nearness_;
  std::vector<float> sharpness_;  ///< n + 2, over 1 the mean of 1 - cosine in the lobe; 0: not kept
  std::vector<float> object_;     ///< id
  std::vector<float> radiance_[3];
  std::vector<float> image_;  ///< 4 a sample
};

}  // namespace catoptric::methods::glossy_lod
