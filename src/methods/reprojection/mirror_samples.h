// The reflective samples of a frame, tile by tile, and the reflected rays of mirrors. Points for
// tracing are made only for samples that are traced.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "methods/reprojection/search.h"
#include "methods/shared/sample_tiles.h"
#include "raster/gbuffer.h"
#include "scene/camera.h"
#include "trace/lobes/reflect.h"

namespace catoptric::methods::reprojection {

/// Whether the reflection of a sample is a single mirrored ray (neither glossy nor refractive).
bool isMirror(scene::Lobe lobe, int object, const scene::Scene& scene);

class MirrorSamples {
 public:
  /// Lists the samples, in the order of SampleTiles. The arguments must stay valid until the next
  /// call.
  void find(const raster::GBufferCopy& source, const scene::Camera& camera,
            const trace::TraceScene& trace, const frame::ObjectSet& own);
  /// Computes the results of rays(), positions() and belowHorizon().
  void aim();

  std::size_t count() const { return places_.size(); }
  const raster::GBufferCopy& source() const { return *source_; }
  const scene::Camera& camera() const { return *camera_; }
  /// The index of each sample in the G-buffer.
  std::span<const std::uint32_t> places() const { return places_; }
  /// The range [first, last) of a tile's sample numbers; tiles are ordered along rows.
  std::pair<std::size_t, std::size_t> ofTile(std::size_t tile) const {
    return {first_[tile], first_[tile + 1]};
  }
  /// The mirrored rays; reflector 0 if the sample is not a mirror.
  std::span<const MirrorRay> rays() const { return rays_; }
  /// The surface positions of the samples, from the G-buffer.
  std::span<const Vec3> positions() const { return positions_; }
  /// 1 if the mirrored ray would leave below the surface, so that its normal was corrected.
  std::span<const std::uint8_t> belowHorizon() const { return belowHorizon_; }
  /// Calls body(first, lanes) for each tile with samples, in any thread: the number of its first
  /// sample, and the tile as points of the thread's LobeTracer. `traced` makes the same packets of
  /// rays from them.
  void eachTile(const std::function<void(std::size_t, trace::PointLanes&)>& body) const;
  /// Calls body(slots, lanes) for each tile that has samples with a `slots` entry other than 0. The
  /// lanes contain all samples of the ray packets in which these samples lie, as `traced` makes the
  /// packets. Whole tiles are passed if a sample has more than one ray (up to `rays` per lobe) or
  /// paths continue.
  void eachPacketOf(
      std::span<const std::uint32_t> slots, const trace::ReflectionOptions& options,
      const std::function<void(std::span<const std::uint32_t>, trace::PointLanes&)>& body) const;
  /// The samples `places` as points for tracing.
  void points(std::span<const std::uint32_t> places,
              std::vector<trace::ReflectionPoint>& result) const;

 private:
  /// Whether a tile's rays have the same numbers as its samples, so that single packets can be
  /// traced.
  bool isSplit(const SampleTiles::Members& members, const trace::ReflectionOptions& options) const;

  const raster::GBufferCopy* source_ = nullptr;
  const scene::Camera* camera_ = nullptr;
  const trace::TraceScene* trace_ = nullptr;
  std::vector<SampleTiles::Members> tiles_;
  std::vector<std::size_t> first_;  ///< first sample of each tile, and the number of samples
  std::vector<std::uint32_t> places_;
  std::vector<MirrorRay> rays_;
  std::vector<Vec3> positions_;
  std::vector<std::uint8_t> belowHorizon_;
  frame::ObjectSet own_;
};

}  // namespace catoptric::methods::reprojection
