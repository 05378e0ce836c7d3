// Takes the reflections of a frame's samples from a key frame, as far as they are there: the
// paper's steps search, shift and warp, for all samples.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "frame/steps.h"
#include "methods/contract/method.h"
#include "methods/reprojection/grid.h"
#include "methods/reprojection/key_frame.h"
#include "methods/reprojection/moving_boxes.h"
#include "methods/reprojection/options.h"
#include "methods/reprojection/search.h"
#include "methods/shared/reflective_samples.h"
#include "raster/gbuffer.h"

namespace catoptric::methods::reprojection {

/// Whether the light of a reflective sample comes along one mirrored ray: neither a lobe nor a body
/// that refracts.
bool isMirror(const trace::ReflectionPoint& point, const scene::Scene& scene);

class Reuse {
 public:
  /// `searches`: follow the reflection; false: keep it on its surface (image_warp).
  Reuse(const Options& options, bool searches)
      : options_(options), searches_(searches), grid_(options) {}

  /// Begins a frame: nothing is found yet. `current` and `samples` stay with the caller until the
  /// next one. Times itself as `search`.
  void begin(const raster::GBufferCopy& current, const ReflectiveSamples& samples,
             const scene::Camera& camera, Services& services);
  /// Looks in `key` for what has not been found yet, and fills radiance[i] of what is. Times itself
  /// as `search`, `shift` and `warp`.
  void findIn(const KeyFrame& key, Services& services, std::vector<Vec3>& radiance);

  /// Of samples.points[i]: Found, or why it was not found in the first of the key frames.
  Outcome outcome(std::size_t i) const { return outcomes_[i]; }

 private:
  /// findIn() by the paper's mapping.
  void findByGrid(const KeyFrame& key, Services& services, std::vector<Vec3>& radiance);
  /// What is to be found in this key frame, and where it saw the surfaces: not what lies at an edge
  /// of an earlier one, since others show the same edge.
  void attach(const KeyFrame& key, const Services& services);
  struct Tile {
    int left, top, right, bottom;
  };
  /// All samples, tile by tile, forth and back; the tiles begin `shift` samples before the frame.
  void searchTiles(const KeyFrame& key, int firstSweep, int shift);
  /// Whether another sweep can find more: where all was found and is about as far away, none can.
  bool sweepTile(const KeyFrame& key, int sweep, const Tile& tile);
  /// `beside`: neighbours to start from, -1: none; `last`: another sample that was found. Whether
  /// that changed something.
  bool searchSample(const KeyFrame& key, int sweep, std::int32_t i,
                    const std::array<std::int32_t, 2>& beside, std::int32_t last);
  /// Whether a match shows one surface, on the mirrored ray of sample i.
  bool holds(const KeyFrame& key, std::size_t i, const Match& match) const;
  /// The match of sample i, from its neighbours' and from where its surface was.
  Match searchFrom(const KeyFrame& key, std::size_t i, std::span<const Vec2> starts) const;
  void warpInPlace(const KeyFrame& key, const Services& services);
  void shift(const KeyFrame& key, std::vector<Vec3>& radiance);
  void warp(const KeyFrame& key, const frame::Geometry& geometry, std::vector<Vec3>& radiance);
  /// Area of the key frame that a sample shows, in its samples; 1 where no neighbour tells.
  float keyArea(std::size_t at) const;

  Options options_;
  bool searches_;
  GridMapping grid_;
  scene::Camera camera_;
  const raster::GBufferCopy* current_ = nullptr;
  const ReflectiveSamples* samples_ = nullptr;
  MovingBoxes moving_;
  // By sample of the G-buffer: index in `samples`, -1: none. By index in `samples`: the others.
  std::vector<std::int32_t> indexOf_;
  std::vector<MirrorRay> rays_;  ///< reflector 0: not asked
  std::vector<Outcome> outcomes_;
  // Of the key frame in turn.
  std::vector<std::uint32_t> pending_;
  std::vector<Vec2> attached_;  ///< where it saw the surface; NaN: nowhere
  std::vector<Match> matches_;
  std::vector<std::uint8_t> changed_;  ///< the sweep in which the match last changed
  std::vector<Vec4> places_;           ///< what the match shows
};

}  // namespace catoptric::methods::reprojection
