// A smooth transition between retraced and reprojected samples ([Xie2017] Sec. 5, future work): in
// a band around each retraced area samples are also traced and blended with their reprojected
// value, with a weight that falls with distance.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "methods/reprojection/mirror_samples.h"
#include "methods/reprojection/reuse.h"

namespace catoptric::methods::reprojection {

class Border {
 public:
  /// Sample `index` is to be blended with the weight `traced` for its traced radiance.
  struct Member {
    std::uint32_t index;
    float traced;
  };
  /// The reprojected samples within `width` samples of a missing one on the same reflector, the
  /// nearest first. Missing samples that form a line along an edge of the reflected scene have no
  /// band, because the samples beside an edge are as accurate as others.
  std::span<const Member> find(const MirrorSamples& samples, const Reuse& reuse,
                               std::span<const std::uint32_t> missing, int width);

 private:
  // Kept across frames to avoid allocations.
  std::vector<Member> members_;
  std::vector<std::uint32_t> ring_;
  std::vector<std::uint32_t> next_;
  std::vector<std::uint8_t> taken_;  ///< indexed by sample
};

}  // namespace catoptric::methods::reprojection
