// Tiles of a G-buffer's reflective samples, in an order that keeps rays coherent.
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

/// Whether some samples of a reflector of `own` may not reflect, their s being a texture's: only
/// then must s be read back.
bool specularLevelsVary(const scene::Scene& scene, const frame::ObjectSet& own);

/// A G-buffer's size in samples.
struct SampleGrid {
  int width;
  int height;
};

class SampleTiles {
 public:
  static constexpr int kSize = 16;  ///< samples a side; ours
  static constexpr std::size_t kSamples = kSize * kSize;
  /// Samples of a tile.
  struct Members {
    std::size_t count = 0;
    std::array<std::uint32_t, kSamples> at;    ///< index in the copy
    std::array<std::uint16_t, kSamples> x, y;  ///< in the frame
    std::span<const std::uint32_t> places() const { return {at.data(), count}; }
  };

  /// Of samples with s > 0 on an object of `own`. `extents`:
  /// trace::reflectorExtent() by object.
  SampleTiles(const SampleGrid& grid, const scene::Camera& camera, const scene::Scene& scene,
              std::span<const float> extents, const frame::ObjectSet& own);

  int columns() const { return columns_; }
  /// Rows of tiles that hold so many rows of samples.
  static int rowsOf(int sampleRows) { return (sampleRows + kSize - 1) / kSize; }

  bool reflects(const raster::GBufferCopy& source, std::size_t at) const {
    const Kind kind = kinds_[source.object[at]];
    return kind != Kind::No && source.depth[at] > 0.0f &&
           (kind == Kind::Yes || source.diffuse[4 * at + 3] > 0.0f);
  }

  /// The tile's samples, a tile's row counted from the first of `source`: by object, within an
  /// object along rows of 4 x 2 blocks.
  void find(const raster::GBufferCopy& source, int column, int row, Members& out) const;

  /// Those as points to trace from: the vector code's twin of SamplePoints.
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
