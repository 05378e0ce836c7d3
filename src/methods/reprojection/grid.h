// The paper's own forward mapping [Xie2017] Sec. 3.2. Each sample of the key frame searches the
// sample whose surface would now reflect the same point (Algorithm 2). A triangle mesh moves the
// reflections there, and a second mesh warps them into the current view. Serves for comparison
// with the gather in search.h.
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

  /// Algorithm 2 for all samples of the key frame, for the current camera `now`. Starts at the
  /// offsets of the frame before if it had the same key frame.
  void search(const KeyFrame& key, const frame::Geometry& geometry, const scene::Camera& now);
  /// Makes the intermediate reflection image: the key frame's samples at their offsets, nearest in
  /// front.
  void shift(const KeyFrame& key);
  /// Warps that image into the current view.
  void warp(const KeyFrame& key, const scene::Camera& now);
  /// The result for sample `at` of the current frame, which shows a reflector at this distance from
  /// the eye.
  Outcome found(std::size_t at, std::uint32_t reflector, float distance, Vec3& radiance) const;

  /// Per key-frame sample, the offset to the current position of its reflection; NaN: invalid.
  std::span<const Vec2> offsets() const { return offsets_; }

 private:
  /// An image of reflections with depth.
  struct Layer {
    std::vector<std::uint32_t> reflector;  ///< id; 0: the sample is empty
    std::vector<float> depth;
    std::vector<Vec3> radiance;
    void clear(std::size_t count);
    void put(std::size_t at, std::uint32_t id, float z, const Vec3& light);
  };
  /// Squared distance by which the reflection of `place` at sample (x, y) misses the current eye.
  float miss(const KeyFrame& key, std::uint32_t reflector, const Vec4& place, const Vec3& eye,
             int x, int y) const;
  Vec2 offsetOf(const KeyFrame& key, int x, int y, const Vec2& start, const Vec3& eye) const;

  Options options_;
  int keyNumber_ = 0;          ///< KeyFrame::number() of the key frame to which the offsets belong
  std::vector<Vec3> surface_;  ///< W of Algorithm 2: the position of the reflecting surface, by
                               ///< sample of the key frame
  std::vector<Vec2> offsets_;
  Layer shifted_;
  Layer warped_;
};

}  // namespace catoptric::methods::reprojection
