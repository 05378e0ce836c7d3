// The reflective samples of a frame, tile by tile, and the mirrored rays of those that are mirrors.
// Points to trace from are made of those samples alone that are traced.
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

/// Whether the light of a reflective sample comes along one mirrored ray: neither a lobe nor a body
/// that refracts.
bool isMirror(scene::Lobe lobe, int object, const scene::Scene& scene);

class MirrorSamples {
 public:
  /// Lists the samples, in the order of SampleTiles. All stay with the caller until the
  /// next call.
  void find(const raster::GBufferCopy& source, const scene::Camera& camera,
            const trace::TraceScene& trace, const frame::ObjectSet& own);
  /// Makes what rays(), positions() and belowHorizon() give.
  void aim();

  std::size_t count() const { return places_.size(); }
  const raster::GBufferCopy& source() const { return *source_; }
  const scene::Camera& camera() const { return *camera_; }
  /// Index of each in the G-buffer.
  std::span<const std::uint32_t> places() const { return places_; }
  /// The numbers of a tile's samples, from one to before another; tiles lie along rows.
  std::pair<std::size_t, std::size_t> ofTile(std::size_t tile) const {
    return {first_[tile], first_[tile + 1]};
  }
  /// Reflector 0 where it is no mirror.
  std::span<const MirrorRay> rays() const { return rays_; }
  /// Of its surface, as the G-buffer has it.
  std::span<const Vec3> positions() const { return positions_; }
  /// 1 where the mirrored ray would leave below the surface, so that its normal was bent.
  std::span<const std::uint8_t> belowHorizon() const { return belowHorizon_; }
  /// Calls body(first, lanes) for each tile with samples, on any thread: the first one's number,
  /// and the tile as points of the thread's LobeTracer, of which `traced` makes the same packets of
  /// rays.
  void eachTile(const std::function<void(std::size_t, trace::PointLanes&)>& body) const;
  /// Calls body(slots, lanes) for each tile with samples of which `slots` is not 0, by number: the
  /// rays' packets that hold them, with all their samples, as `traced` makes them, and the slots of
  /// these. Whole tiles where one ray of each sample, of up to `rays` of its lobe, is not all:
  /// where paths go on, and where a sample has a lobe.
  void eachPacketOf(
      std::span<const std::uint32_t> slots, const trace::ReflectionOptions& options,
      const std::function<void(std::span<const std::uint32_t>, trace::PointLanes&)>& body) const;
  /// Those samples as points to trace from.
  void points(std::span<const std::uint32_t> places,
              std::vector<trace::ReflectionPoint>& result) const;

 private:
  /// Whether the numbers of a tile's rays are those of its samples, and only packets of them meet.
  bool isSplit(const SampleTiles::Members& members, const trace::ReflectionOptions& options) const;

  const raster::GBufferCopy* source_ = nullptr;
  const scene::Camera* camera_ = nullptr;
  const trace::TraceScene* trace_ = nullptr;
  std::vector<SampleTiles::Members> tiles_;
  std::vector<std::size_t> first_;  ///< of each tile, and their number
  std::vector<std::uint32_t> places_;
  std::vector<MirrorRay> rays_;
  std::vector<Vec3> positions_;
  std::vector<std::uint8_t> belowHorizon_;
  frame::ObjectSet own_;
};

}  // namespace catoptric::methods::reprojection
