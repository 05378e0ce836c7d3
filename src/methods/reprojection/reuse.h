// Takes the reflections of a frame's samples from a key frame, as far as they are there: the
// paper's steps search, shift and warp, for all samples.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <vector>

#include "frame/steps.h"
#include "methods/contract/method.h"
#include "methods/reprojection/cell_lanes.h"
#include "methods/reprojection/grid.h"
#include "methods/reprojection/key_frame.h"
#include "methods/reprojection/mirror_samples.h"
#include "methods/reprojection/moving_boxes.h"
#include "methods/reprojection/options.h"
#include "methods/reprojection/search.h"
#include "methods/shared/sample_tiles.h"
#include "raster/gbuffer.h"

namespace catoptric::methods::reprojection {

class Reuse {
 public:
  /// Samples along an edge; a sample starts from its neighbours in it.
  static constexpr int kTile = SampleTiles::kSize;

  explicit Reuse(const Options& options) : options_(options), grid_(options) {}

  /// Begins a frame: nothing is found yet. `samples` stay with the caller until the next one. Times
  /// itself as `search`.
  void begin(const MirrorSamples& samples, Services& services) {
    begin(samples, services, samples.rays());
  }
  /// Those with a reflector in `rays` alone, which stay with the caller likewise.
  void begin(const MirrorSamples& samples, Services& services, std::span<const MirrorRay> rays);
  /// Looks in `key`, once a frame, and fills radiance[i] of what is found. Times itself as
  /// `search`, `shift` and `warp`.
  void findIn(const KeyFrame& key, Services& services, std::vector<Vec3>& radiance);

  /// Of sample i: Found, or why it was not found.
  Outcome outcome(std::size_t i) const { return outcomes_[i]; }
  /// The number of the sample at (x, y) of the G-buffer; -1: it does not reflect.
  std::int32_t sampleAt(int x, int y) const {
    return indexOf_[static_cast<std::size_t>(y * width_ + x)];
  }
  /// Of a sample that was found.
  const Match& match(std::size_t i) const { return matches_[i]; }
  /// Whether sample i was found in `key`, and shows the sky; not by the paper's mapping, which
  /// keeps no matches.
  bool showsSky(const KeyFrame& key, std::size_t i) const;
  /// It is not found after all.
  void lose(std::size_t i, Outcome outcome) { outcomes_[i] = outcome; }

 private:
  /// findIn() by the paper's mapping.
  void findByGrid(const KeyFrame& key, Services& services, std::vector<Vec3>& radiance);
  /// Where the key frame saw the surfaces.
  void attach(const KeyFrame& key, const Services& services);
  struct Tile {
    int left, top, right, bottom;
  };
  /// Some neighbouring samples, and those at their corners (left to right, then below), -1: none.
  struct Cell {
    int left, top, right, bottom;  ///< all inclusive
    std::array<std::int32_t, 4> node;
  };
  /// Calls body(tile) for all tiles, which begin `shift` samples before the frame.
  void forTiles(int shift, const std::function<void(const Tile&)>& body) const;
  /// What is known of a tile that begins with the frame.
  struct TileState {
    bool all = false;  ///< all of it was found by its cells, or nothing is to be found
    float nearest = std::numeric_limits<float>::infinity();  ///< of all, Match::length
    float farthest = 0.0f;
  };
  /// Whether samples of a tile, one of MirrorSamples, are to be found.
  bool isAskedIn(std::size_t tile) const;
  /// Whether no sample of a tile of any place can find more from its neighbours.
  bool settled(const Tile& tile) const;
  /// What the corners of a cell tell.
  struct Corners {
    std::array<bool, 4> known{};  ///< was found
    std::array<Vec2, 4> offset{};
    bool agree = false;  ///< they show one surface that is not stretched too far
  };
  /// Searches the corners of a tile's cells, and finds others by theirs, with their radiance.
  TileState fillTile(const KeyFrame& key, const Tile& tile, std::vector<Vec3>& radiance);
  Corners corners(const KeyFrame& key, const Cell& cell) const;
  /// Adds the cell's samples at offsets between its corners', or at the nearest one's where they do
  /// not agree. Whether that is all of them.
  bool expect(const Cell& cell, const Corners& corners, CellLanes& lanes);
  /// Takes what is found of the lanes, and keeps those that another correction may find. How many
  /// of the others there were.
  std::size_t take(const KeyFrame& key, CellLanes& lanes, std::vector<Vec3>& radiance);
  /// Whether another sweep can find more: where all was found and is about as far away, none can.
  bool sweepTile(const KeyFrame& key, int sweep, const Tile& tile);
  /// Where sample `i` would be if it had moved like sample `n`, -1: none.
  Vec2 like(std::int32_t i, std::int32_t n) const;
  /// Looks for a sample that was not found yet. `beside`: neighbours to start from, -1: none;
  /// `last`: another sample that was found. Whether it is found.
  bool findFrom(const KeyFrame& key, int sweep, std::int32_t i,
                const std::array<std::int32_t, 2>& beside, std::int32_t last);
  /// That, and whether what a neighbour shows is in front of it. Whether that changed something.
  bool searchSample(const KeyFrame& key, int sweep, std::int32_t i,
                    const std::array<std::int32_t, 2>& beside, std::int32_t last);
  /// Whether a match shows one surface, on the mirrored ray of sample i.
  bool holds(const KeyFrame& key, std::size_t i, const Match& match) const;
  /// The match of sample i, from its neighbours' and from where its surface was.
  Match searchFrom(const KeyFrame& key, std::size_t i, std::span<const Vec2> starts) const;
  void warpInPlace(const KeyFrame& key, const Services& services);
  void shift(const KeyFrame& key, std::vector<Vec3>& radiance);
  void warp(const KeyFrame& key, const frame::Geometry& geometry, std::vector<Vec3>& radiance);
  /// Whether a sample beside i does not show its reflector.
  bool atRim(std::size_t i) const;
  /// Area of the key frame that a sample shows, in its samples; 1 where no neighbour tells.
  float keyArea(std::size_t at) const;

  Options options_;
  GridMapping grid_;
  const MirrorSamples* samples_ = nullptr;
  int width_ = 0;  ///< of the frame, in samples
  int height_ = 0;
  MovingBoxes moving_;
  // By sample of the G-buffer: index in `samples`, -1: none. By index in `samples`: the others.
  std::vector<std::int32_t> indexOf_;
  std::span<const MirrorRay> rays_;  ///< reflector 0: not asked
  std::vector<Outcome> outcomes_;
  std::vector<std::uint32_t> pending_;
  std::vector<Vec2> attached_;  ///< where it saw the surface; NaN: nowhere
  std::vector<Match> matches_;
  /// Whether radiance and place of a match are known by its cell, and its magnification too.
  enum class Shown : std::uint8_t { Unknown, Known, Measured };
  std::vector<Shown> shown_;
  std::vector<TileState> tiles_;       ///< along rows
  std::vector<std::uint8_t> changed_;  ///< the sweep in which the match last changed
  std::vector<Vec4> places_;           ///< what the match shows
};

}  // namespace catoptric::methods::reprojection
