// Reflections of reflections ([Xie2017] Sec. 5, future work). The hit after a second mirror is
// stored as a point on the first reflected ray at the length of the whole path, that is, behind
// the second mirror. For a plane second mirror this point does not depend on the view. It is
// searched in separate buffers like a first hit, and its radiance is added to that of the second
// mirror.
#pragma once

#include <cstdint>
#include <vector>

#include "methods/reprojection/key_frame.h"
#include "methods/reprojection/mirror_samples.h"
#include "methods/reprojection/options.h"
#include "methods/reprojection/reuse.h"

namespace catoptric::methods::reprojection {

class SecondBounce {
 public:
  /// Stores nothing if paths have only one bounce.
  explicit SecondBounce(const Options& options)
      : options_(options),
        used_(options.bounces > 1 && options.mapping == Mapping::Gather),
        reuse_(options) {}

  /// Whether second bounces are stored; never in scenes with motion.
  bool used(const frame::Geometry& geometry) const;
  /// As KeyFrame::begin(). Call it together with begin() and finish() of the key frame itself.
  void begin(int width, int height, const scene::Camera& camera, const frame::Lighting& lighting,
             const frame::Geometry& geometry);
  /// Stores the hit after the second mirror. Returns whether it can be reprojected. Threads may
  /// store different samples at the same time.
  bool keep(std::size_t at, const trace::ReflectionPoint& point, const trace::FirstHit& hit,
            const trace::SecondHit& second, const scene::Scene& scene);
  void finish(const frame::Geometry& geometry, float epsilon);

  /// Adds the radiance of second bounces to radiance[i] of the samples that `first` found in `key`
  /// on a second mirror. Samples whose second bounce is not found, or not along the second
  /// reflected ray, are marked as not found in `first`.
  void find(const MirrorSamples& samples, const KeyFrame& key, Reuse& first, Services& services,
            std::vector<Vec3>& radiance);

 private:
  /// The fidelity test over both bounces: whether the point found for sample i lies where the
  /// second mirror, as matched in `first`, reflects the ray.
  bool faithful(std::size_t i, const KeyFrame& key, const Match& first) const;

  Options options_;
  bool used_;
  /// Stores the normals of second mirrors. shown(): the second mirror and the object seen in it.
  KeyFrame key_;
  Reuse reuse_;
  std::vector<MirrorRay> rays_;
  std::vector<Vec3> radiance_;
};

}  // namespace catoptric::methods::reprojection
