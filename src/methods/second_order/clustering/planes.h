// Planes that many samples of a bin lie on: parts of it of their own, exact mirrors.
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

/// Samples are on one plane when no normal leaves the plane's by more (radians) and none the plane
/// by more than this share of its distance from the eye: a pixel's reflection moves by less than a
/// tenth of a texel of a 1024 pixel frame. Ours.
constexpr float kPlanarNormal = 1e-4f;
constexpr float kPlanarOffset = 5e-5f;
constexpr std::size_t kPlanes = 4;           ///< planar clusters of a bin, at most; ours
constexpr std::size_t kParts = kPlanes + 1;  ///< of a bin: what is on no plane, and the planes

/// A plane that samples may lie on, and its weight in a vote.
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

/// The planes that most samples of a bin lie on: every plane with more than 1 / (kPlanes + 1) of
/// them is among these [Misra1982].
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
  /// Whether all samples have voted for one plane; if not, none has voted.
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

/// Votes of the samples from `first` on whose normal is the one before's: where neighbours' normals
/// differ there is no plane.
void vote(const SampleBlock& block, std::uint32_t first, std::uint32_t last, BinPlanes& planes);

}  // namespace catoptric::methods::second_order
