// Takes the reflections of a frame's samples from a key frame where possible: the paper's steps
// search, shift and warp, for all samples.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <utility>
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
  /// Edge length of a tile in samples. A sample's search starts from its neighbours in the tile.
  static constexpr int kTile = SampleTiles::kSize;

  explicit Reuse(const Options& options) : options_(options), grid_(options) {}

  /// Begins a frame, in which no sample is found yet. `samples` must stay valid until the next
  /// begin(). Timed as `search`.
  void begin(const MirrorSamples& samples, Services& services) {
    begin(samples, services, samples.rays());
  }
  /// As begin(), but only for samples with a reflector in `rays`, which must stay valid too.
  void begin(const MirrorSamples& samples, Services& services, std::span<const MirrorRay> rays);
  /// Searches `key`, once per frame, and sets radiance[i] of the samples that are found. Timed as
  /// `search`, `shift` and `warp`.
  void findIn(const KeyFrame& key, Services& services, std::vector<Vec3>& radiance);

  /// For sample i: Found, or why it was not found.
  Outcome outcome(std::size_t i) const { return outcomes_[i]; }
  /// The number of the sample at (x, y) of the G-buffer; -1: it is not reflective.
  std::int32_t sampleAt(int x, int y) const {
    return indexOf_[static_cast<std::size_t>(y * width_ + x)];
  }
  /// The match of a sample that was found.
  const Match& match(std::size_t i) const { return matches_[i]; }
  /// Whether sample i was found in `key` and reflects the sky. Not available for the paper's
  /// mapping, which stores no matches.
  bool showsSky(const KeyFrame& key, std::size_t i) const;
  /// Marks a sample as not found.
  void lose(std::size_t i, Outcome outcome) { outcomes_[i] = outcome; }

 private:
  /// findIn() with the paper's mapping.
  void findByGrid(const KeyFrame& key, Services& services, std::vector<Vec3>& radiance);
  /// Finds the positions of the samples' surfaces in the key frame.
  void attach(const KeyFrame& key, const Services& services);
  struct Tile {
    int left, top, right, bottom;
  };
  /// A rectangle of samples, and the samples at its corners (left to right, then below); -1: none.
  struct Cell {
    int left, top, right, bottom;  ///< all inclusive
    std::array<std::int32_t, 4> node;
  };
  int tileColumns() const { return (width_ + kTile - 1) / kTile; }
  /// Calls body(tile, index) for all tiles, which are ordered along rows.
  void forTiles(const std::function<void(const Tile&, std::size_t)>& body) const;
  struct TileState {
    bool all = false;  ///< all samples of the tile were found by cells, or none is searched
    float nearest = std::numeric_limits<float>::infinity();  ///< smallest Match::length in the tile
    float farthest = 0.0f;
    bool stirred = false;  ///< a match in the tile changed in the last sweep or round
  };
  /// Whether no match in the tile can change: all samples were found, at similar distances.
  bool settled(const TileState& state) const {
    return state.all && state.nearest >= state.farthest * (1.0f - options_.epsilon);
  }
  /// Whether a round of spread() may change the tile.
  bool mayChange(std::size_t tile, int round) const;
  /// Whether any sample of a tile of MirrorSamples is searched.
  bool isAskedIn(std::size_t tile) const;
  /// The state of a cell's corners.
  struct Corners {
    std::array<bool, 4> known{};  ///< the corner was found
    std::array<Vec2, 4> offset{};
    bool agree = false;  ///< they show one surface, and the match is not stretched too much
  };
  /// Searches the corners of a tile's cells, and interpolates the other samples.
  TileState fillTile(const KeyFrame& key, const Tile& tile, std::vector<Vec3>& radiance);
  Corners corners(const KeyFrame& key, const Cell& cell) const;
  /// Adds the cell's samples to `lanes` with offsets interpolated between its corners, or with the
  /// nearest corner's offset if the corners do not agree. Returns whether all samples were added.
  bool expect(const Cell& cell, const Corners& corners, CellLanes& lanes);
  /// Takes the results of the lanes, and keeps the lanes that another correction may find. Returns
  /// the number of lanes that are done.
  std::size_t take(const KeyFrame& key, CellLanes& lanes, std::vector<Vec3>& radiance);
  /// Searches a tile's samples, starting at the matches of their neighbours: sweep 0 from the top
  /// left corner on, sweep 1 from the bottom right one. Returns whether another sweep can find
  /// more.
  bool sweepTile(const KeyFrame& key, int sweep, const Tile& tile, TileState& state);
  /// Where sample `i` would be in the key frame if it had moved like sample `n`; -1: none.
  Vec2 like(std::int32_t i, std::int32_t n) const;
  /// Searches a sample that was not found yet. `beside`: neighbours to start from, -1: none;
  /// `last`: another sample that was found. Returns whether it was found.
  bool findFrom(const KeyFrame& key, int sweep, std::int32_t i,
                const std::array<std::int32_t, 2>& beside, std::int32_t last);
  /// As findFrom(); also tests whether a neighbour reflects a nearer surface. True if the match has
  /// changed.
  bool searchSample(const KeyFrame& key, int sweep, std::int32_t i,
                    const std::array<std::int32_t, 2>& beside, std::int32_t last);
  /// Whether something at this distance (KeyFrame::length()) is in front of a match.
  bool isNearer(float length, const Match& match) const {
    return length < match.length * (1.0f - options_.epsilon);
  }
  /// Starts at neighbour n and searches a match of sample i, or if it has one, a nearer surface.
  /// Returns whether `match` has changed.
  bool lead(const KeyFrame& key, std::int32_t n, std::int32_t i, Match& match) const;
  void accept(std::int32_t i, const Match& match, int sweep) {
    matches_[i] = match;
    changed_[i] = static_cast<std::uint16_t>(sweep);
    shown_[i] = Shown::Unknown;
  }
  /// The sample at (x, y) if it shows the reflector; otherwise -1.
  std::int32_t reflecting(int x, int y, std::uint32_t reflector) const {
    const std::int32_t i =
        x >= 0 && y >= 0 && x < width_ && y < height_ ? sampleAt(x, y) : std::int32_t{-1};
    return i >= 0 && rays_[i].reflector == reflector ? i : -1;
  }
  /// The position in this frame whose mirrored ray meets the hit of the key frame's sample `at`, by
  /// Newton's method from `start`; NaN: none.
  Vec2 goesTo(const KeyFrame& key, std::size_t at, const Vec2& start) const;
  /// Whether the hit of the key frame's sample `at` is in front of the match of sample i.
  bool hides(const KeyFrame& key, std::size_t at, std::int32_t i) const;
  /// Moves the key frame's near edges to this frame, and starts searches at edges that no sample
  /// reflects.
  void findNearer(const KeyFrame& key, const frame::Geometry& geometry);
  /// Samples search from their neighbours, also across tile borders, until nothing changes.
  void spread(const KeyFrame& key);
  /// Rejects matches beside a near edge that is in front of them.
  void markEdges(const KeyFrame& key);
  /// Whether a match shows one surface and lies on the mirrored ray of sample i.
  bool holds(const KeyFrame& key, std::size_t i, const Match& match) const;
  /// Searches sample i from the offsets `starts` and from its surface's former position.
  Match searchFrom(const KeyFrame& key, std::size_t i, std::span<const Vec2> starts) const;
  void warpInPlace(const KeyFrame& key, const Services& services);
  void shift(const KeyFrame& key, std::vector<Vec3>& radiance);
  void warp(const KeyFrame& key, const frame::Geometry& geometry, std::vector<Vec3>& radiance);
  /// Whether a neighbour of sample i does not show its reflector.
  bool atRim(std::size_t i) const;
  /// Area of the key frame, in its samples, that a sample covers; 1 if no neighbour is known.
  float keyArea(std::size_t at) const;

  Options options_;
  GridMapping grid_;
  const MirrorSamples* samples_ = nullptr;
  int width_ = 0;  ///< of the frame, in samples
  int height_ = 0;
  MovingBoxes moving_;
  // indexOf_ is indexed by sample of the G-buffer and contains the index in `samples`, or -1. The
  // other arrays are indexed by this index.
  std::vector<std::int32_t> indexOf_;
  std::span<const MirrorRay> rays_;  ///< reflector 0: the sample is not searched
  std::vector<Outcome> outcomes_;
  std::vector<std::uint32_t> pending_;
  std::vector<Vec2> attached_;  ///< position of the sample's surface in the key frame; NaN: none
  std::vector<Match> matches_;
  /// Whether the radiance and position of a match are already set (Known), and its magnification is
  /// already tested too (Measured).
  enum class Shown : std::uint8_t { Unknown, Known, Measured };
  std::vector<Shown> shown_;
  std::vector<TileState> tiles_;        ///< ordered along rows
  std::vector<std::uint16_t> changed_;  ///< the sweep or round in which the match last changed
  /// Matches of one round of spread(), by tile.
  std::vector<std::vector<std::pair<std::int32_t, Match>>> found_;
  struct NearEdge {
    Vec2 goesTo{std::numeric_limits<float>::quiet_NaN()};
    std::int32_t sample = -1;  ///< the sample that got a match from this edge; -1: none
    Match match;
  };
  std::vector<NearEdge> edges_;  ///< the key frame's near edges
  int edgesOf_ = 0;              ///< KeyFrame::number() of the key frame of edges_
  std::vector<Vec4> places_;     ///< position of the match's reflected point
};

}  // namespace catoptric::methods::reprojection
