// Reflections of reflections [Xie2017] Sec. 5, outlook. What a mirror in a mirror shows is kept as
// if it lay behind that mirror, at the length of the whole path along the first ray: there it stays
// if the second mirror is plane. It is searched for like what one mirror shows, in buffers of its
// own, and added to the light of the second mirror itself, which is found where that mirror is.
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
  /// `bounces`: of paths; with one nothing is kept.
  explicit SecondBounce(const Options& options)
      : options_(options),
        used_(options.bounces > 1 && options.mapping == Mapping::Gather),
        reuse_(options) {}

  /// Whether what mirrors in mirrors show is kept: not where anything moves.
  bool used(const frame::Geometry& geometry) const;
  /// As of KeyFrame; the key frame that it belongs to is begun and finished beside it.
  void begin(int width, int height, const scene::Camera& camera, const frame::Lighting& lighting,
             const frame::Geometry& geometry);
  /// Keeps what the second mirror shows; whether that can be found again. Threads may keep
  /// different samples at once.
  bool keep(std::size_t at, const trace::ReflectionPoint& point, const trace::FirstHit& hit,
            const trace::SecondHit& second, const scene::Scene& scene);
  void finish(const frame::Geometry& geometry, float epsilon);

  /// Adds to radiance[i] what second mirrors show, of the samples that `first` has found on them in
  /// `key`; those that are not found, or not where the second mirror's ray goes, `first` loses.
  void find(const MirrorSamples& samples, const KeyFrame& key, Reuse& first, Services& services,
            std::vector<Vec3>& radiance);

 private:
  /// The fidelity test over both bounces: whether what was found of sample i lies where the mirror,
  /// as `first` has found it, sends the ray.
  bool faithful(std::size_t i, const KeyFrame& key, const Match& first) const;

  Options options_;
  bool used_;
  /// Its normals are the second mirrors'; its shown() is second mirror and what that shows.
  KeyFrame key_;
  Reuse reuse_;
  std::vector<MirrorRay> rays_;
  std::vector<Vec3> radiance_;
};

}  // namespace catoptric::methods::reprojection
