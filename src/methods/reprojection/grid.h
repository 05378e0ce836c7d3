// The paper's own mapping [Xie2017] Sec. 3.2, forwards: each sample of the key frame looks for the
// sample whose surface would now reflect what it shows (Algorithm 2), a mesh of triangles moves
// reflections there, and a second mesh moves them into the current view. The yardstick of the
// gather in search.h.
#pragma once

#include <span>
#include <vector>

#include "methods/reprojection/key_frame.h"
#include "methods/reprojection/options.h"
#include "methods/reprojection/search.h"
#include "methods/shared/reflective_samples.h"

namespace catoptric::methods::reprojection {

class GridMapping {
 public:
  explicit GridMapping(const Options& options) : options_(options) {}

  /// Algorithm 2 for all samples of the key frame as seen by `now`; begins at the offsets of the
  /// frame before, if that had the same key frame.
  void search(const KeyFrame& key, const frame::Geometry& geometry, const scene::Camera& now);
  /// The intermediate reflection image: the key frame's samples at their offsets, nearest on top.
  void shift(const KeyFrame& key);
  /// That image in the current view.
  void warp(const KeyFrame& key, const scene::Camera& now);
  /// What was found for sample `at` of the current frame, which shows a reflector so far from the
  /// eye.
  Outcome found(std::size_t at, std::uint32_t reflector, float distance, Vec3& radiance) const;

  /// Of the key frame's sample, from where it was to where its reflection is now; NaN: invalid.
  std::span<const Vec2> offsets() const { return offsets_; }

 private:
  /// One image of reflections with what hides what.
  struct Layer {
    std::vector<std::uint32_t> reflector;  ///< id; 0: nothing was drawn
    std::vector<float> depth;
    std::vector<Vec3> radiance;
    void clear(std::size_t count);
    void put(std::size_t at, std::uint32_t id, float z, const Vec3& light);
  };
  /// How far the reflection of a place over sample (x, y) misses the current eye; squared.
  float miss(const KeyFrame& key, std::uint32_t reflector, const Vec4& place, const Vec3& eye,
             int x, int y) const;
  Vec2 offsetOf(const KeyFrame& key, int x, int y, const Vec2& start, const Vec3& eye) const;

  Options options_;
  int keyNumber_ = 0;          ///< KeyFrame::number() that the offsets are of
  std::vector<Vec3> surface_;  ///< W by sample of the key frame
  std::vector<Vec2> offsets_;
  Layer shifted_;
  Layer warped_;
};

}  // namespace catoptric::methods::reprojection
