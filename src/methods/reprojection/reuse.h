// Takes the reflections of a frame's samples from a key frame, as far as they are there: the
// paper's steps search, shift and warp, for all samples.
#pragma once

#include <cstdint>
#include <vector>

#include "frame/steps.h"
#include "methods/contract/method.h"
#include "methods/reprojection/key_frame.h"
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
  Reuse(const Options& options, bool searches) : options_(options), searches_(searches) {}

  /// Fills radiance[i] and outcome(i) of samples.points[i]; the radiance of what is not Found is 0.
  /// Times itself as steps `search`, `shift` and `warp`.
  void run(const KeyFrame& key, const raster::GBufferCopy& current,
           const ReflectiveSamples& samples, Services& services, std::vector<Vec3>& radiance);

  Outcome outcome(std::size_t i) const { return matches_[i].outcome; }

 private:
  /// Makes the mirrored rays and where the key frame saw their surfaces.
  void makeRays(const KeyFrame& key, const ReflectiveSamples& samples, const Services& services);
  void searchTile(const KeyFrame& key, const raster::GBufferCopy& current, int tileX, int tileY);
  void warpInPlace(const KeyFrame& key, const ReflectiveSamples& samples, const Services& services);
  /// Area of the key frame that a sample shows, in its samples; 1 where no neighbour tells.
  float keyArea(const raster::GBufferCopy& current, std::size_t at) const;

  Options options_;
  bool searches_;
  // By sample of the G-buffer: index in `samples`, -1: none. By index in `samples`: the others.
  std::vector<std::int32_t> indexOf_;
  std::vector<MirrorRay> rays_;  ///< reflector 0: not asked
  std::vector<Vec2> attached_;   ///< where the key frame saw the surface; NaN: nowhere
  std::vector<Match> matches_;
  std::vector<Vec4> places_;  ///< what the match shows
};

}  // namespace catoptric::methods::reprojection
