// A smooth transition between what is traced anew and what is found again [Xie2017] Sec. 5, their
// outlook: about each area that is traced anew some more samples are, and are mixed with what was
// found for them, the less the farther they are.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "methods/reprojection/mirror_samples.h"
#include "methods/reprojection/reuse.h"

namespace catoptric::methods::reprojection {

class Border {
 public:
  /// Of sample `index` the share `traced` is to be traced light.
  struct Member {
    std::uint32_t index;
    float traced;
  };
  /// The samples that were found within `width` samples of a missing one on the same reflector, the
  /// nearest ones first. Lines along the edges of what is shown have none: what lies beside an edge
  /// is as good as elsewhere.
  std::span<const Member> find(const MirrorSamples& samples, const Reuse& reuse,
                               std::span<const std::uint32_t> missing, int width);

 private:
  // Kept across frames, so that no frame allocates anew.
  std::vector<Member> members_;
  std::vector<std::uint32_t> ring_;
  std::vector<std::uint32_t> next_;
  std::vector<std::uint8_t> taken_;  ///< by sample
};

}  // namespace catoptric::methods::reprojection
