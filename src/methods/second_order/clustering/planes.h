// Finds planes on which many samples of a bin lie. They become clusters: exact mirrors.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "core/math.h"
#include "methods/second_order/clustering/types.h"
#include "methods/second_order/lanes.h"

namespace catoptric::methods::second_order {

/// Samples lie on one plane if no normal deviates by more than kPlanarNormal (radians), and no
/// sample by more than kPlanarOffset of its distance from the eye. A pixel's reflection then moves
/// by less than a tenth of a texel of a 1024-pixel frame. Not from the paper.
constexpr float kPlanarNormal = 1e-4f;
constexpr float kPlanarOffset = 5e-5f;
constexpr std::size_t kPlanes = 4;           ///< maximum per bin; not from the paper
constexpr std::size_t kParts = kPlanes + 1;  ///< parts of a bin: the planes, and the rest

/// A candidate plane and its votes.
struct SamplePlane {
  Vec3 normal{0.0f};
  float offset = 0.0f;  ///< dot(normal, P), relative to the frame's eye
  std::int64_t votes = 0;

  bool holds(const Vec3& position, const Vec3& sampleNormal) const {
    const Vec3 turned = sampleNormal - normal;
    const float off = glm::dot(normal, position) - offset;
    return glm::dot(turned, turned) <= kPlanarNormal * kPlanarNormal &&
           off * off <= kPlanarOffset * kPlanarOffset * glm::dot(position, position);
  }
  Mask4 holds(const Lanes3& position, const Lanes3& sampleNormal) const {
    const Lanes3 turned = minus(sampleNormal, normal);
    const Floats4 off = dot(position, normal) - offset;
    return (dot(turned, turned) <= kPlanarNormal * kPlanarNormal) &
           (off * off <= kPlanarOffset * kPlanarOffset * dot(position, position));
  }
  bool sameAs(const SamplePlane& other) const {
    const Vec3 turned = other.normal - normal;
    return glm::dot(turned, turned) <= kPlanarNormal * kPlanarNormal &&
           std::abs(other.offset - offset) <= kPlanarOffset * std::max(std::abs(offset), 1e-30f);
  }
};

/// The planes on which most samples of a bin lie, by the majority-vote algorithm [Misra1982]: every
/// plane with more than 1 / (kPlanes + 1) of the samples is among them.
struct BinPlanes {
  std::array<SamplePlane, kPlanes> of;

  void vote(const Vec3& position, const Vec3& sampleNormal) {
    SamplePlane* free = nullptr;
    for (SamplePlane& plane : of) {
      if (plane.votes == 0) {
        free = &plane;
      } else if (plane.holds(position, sampleNormal)) {
        ++plane.votes;
        return;
      }
    }
    if (free != nullptr) {
      *free = {sampleNormal, glm::dot(sampleNormal, position), 1};
    } else {
      for (SamplePlane& plane : of) --plane.votes;
    }
  }
  /// Lets all samples vote if they lie on the same plane. Otherwise returns false, and none has
  /// voted.
  bool voteAll(const Lanes3& position, const Lanes3& sampleNormal) {
    for (SamplePlane& plane : of) {
      if (plane.votes == 0) continue;
      const Mask4 held = plane.holds(position, sampleNormal);
      if (noneOf(held)) continue;
      if (!allOf(held)) return false;
      plane.votes += static_cast<std::int64_t>(kLanes);
      return true;
    }
    return false;
  }
  void vote(SamplePlane other) {
    for (SamplePlane& plane : of) {
      if (plane.votes > 0 && plane.sameAs(other)) {
        plane.votes += other.votes;
        return;
      }
    }
    const auto least = std::ranges::min_element(of, {}, &SamplePlane::votes);
    const std::int64_t taken = std::min(least->votes, other.votes);
    for (SamplePlane& plane : of) plane.votes -= taken;
    other.votes -= taken;
    if (least->votes == 0) *least = other;
  }
};

/// Votes of the samples from `first` to `last`. A sample only votes if its normal equals that of
/// its predecessor, because there is no plane where normals differ.
void vote(const SampleBlock& block, std::uint32_t first, std::uint32_t last, BinPlanes& planes);

}  // namespace catoptric::methods::second_order
