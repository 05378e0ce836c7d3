// The reflective samples of a G-buffer in tiles, in an order that keeps rays coherent.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/math.h"
#include "frame/object_set.h"
#include "raster/gbuffer.h"
#include "scene/camera.h"
#include "scene/scene.h"
#include "trace/lobes/point_lanes.h"

namespace catoptric::methods {

/// Whether a reflector of `own` (the objects that this method renders) can have samples with s = 0,
/// because s comes from a texture. Only then must s be read back.
bool specularLevelsVary(const scene::Scene& scene, const frame::ObjectSet& own);

/// A G-buffer's size in samples.
struct SampleGrid {
  int width;
  int height;
};

class SampleTiles {
 public:
  static constexpr int kSize = 16;  ///< edge length in samples; not from a paper
  static constexpr std::size_t kSamples = kSize * kSize;
  /// The samples of a tile.
  struct Members {
    std::size_t count = 0;
    std::array<std::uint32_t, kSamples> at;    ///< index in the GBufferCopy
    std::array<std::uint16_t, kSamples> x, y;  ///< in the frame
    std::span<const std::uint32_t> places() const { return {at.data(), count}; }
  };

  /// For samples with s > 0 on objects of `own`. `extents`: trace::reflectorExtent(), by object.
  SampleTiles(const SampleGrid& grid, const scene::Camera& camera, const scene::Scene& scene,
              std::span<const float> extents, const frame::ObjectSet& own);

  int columns() const { return columns_; }
  /// Number of tile rows for this many rows of samples.
  static int rowsOf(int sampleRows) { return (sampleRows + kSize - 1) / kSize; }

  bool reflects(const raster::GBufferCopy& source, std::size_t at) const {
    const Kind kind = kinds_[source.object[at]];
    return kind != Kind::No && source.depth[at] > 0.0f &&
           (kind == Kind::Yes || source.diffuse[4 * at + 3] > 0.0f);
  }

  /// Lists the tile's samples, sorted by object, then along rows of 4 x 2 blocks. `row` counts
  /// tiles from the first row of `source`.
  void find(const raster::GBufferCopy& source, int column, int row, Members& out) const;

  /// Converts a tile's samples to points for tracing: the vectorized version of SamplePoints.
  void place(const raster::GBufferCopy& source, const Members& members,
             trace::PointLanes& points) const;

 private:
  enum class Kind : std::uint8_t { No, Yes, ByTexture };
  std::vector<Kind> kinds_;     ///< by object id
  std::vector<float> extents_;  ///< by object id
  trace::SampleCamera camera_;
  int width_;
  int columns_;
};

}  // namespace catoptric::methods
