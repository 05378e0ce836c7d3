#include "methods/second_order/cameras/extents.h"

#include "core/parallel.h"

namespace catoptric::methods::second_order {
namespace {

/// Rays closer than this to the image plane (cosine to its axis) say nothing about where the eye
/// should be. Ours.
constexpr float kGrazingCosine = 0.05f;

/// Of one run.
ClusterExtents extentsOf(const SampleBlock& block, const SampleRun& run, const Vec3 centroid,
                         const ClusterFrame frame, float depth) {
  LanesRect near;
  LanesRect far;
  Lanes2 nearSum{}, farSum{};
  Floats4 product{};
  Floats4 sag = floats4(std::numeric_limits<float>::infinity());
  Mask4 rays{};
  for (std::size_t k = 0; k < run.count; k += kLanes) {
    const std::size_t there = run.count - k;
    const Lanes3 direction = block.direction.load(run.first + k, there);
    const Lanes3 fromCentre = minus(block.position.load(run.first + k, there), centroid);
    const Floats4 along = dot(fromCentre, frame.axis);
    sag = least(sag, along);
    const Floats4 z = along + frame.eyeToPlane;
    const Floats4 cosine = dot(direction, frame.axis);
    const Mask4 counts = (z > 0.0f) & (cosine >= kGrazingCosine) & valid(there);
    // e_0 lies on the axis through P_c
    const Lanes2 across{dot(fromCentre, frame.right), dot(fromCentre, frame.down)};
    const Floats4 shrink = frame.eyeToPlane / z;
    const Lanes2 atNear{across.x * shrink, across.y * shrink};
    const Floats4 reach = (depth - along) / cosine;
    const Lanes2 atFar{across.x + reach * dot(direction, frame.right),
                       across.y + reach * dot(direction, frame.down)};
    near.extend(atNear, counts);
    far.extend(atFar, counts);
    const Floats4 none{};
    nearSum.x += counts ? atNear.x : none;
    nearSum.y += counts ? atNear.y : none;
    farSum.x += counts ? atFar.x : none;
    farSum.y += counts ? atFar.y : none;
    product += counts ? atNear.x * atFar.x + atNear.y * atFar.y : none;
    rays -= counts;
  }
  ClusterExtents e;
  e.near = near.all();
  e.far = far.all();
  e.nearSum = {sumOf(nearSum.x), sumOf(nearSum.y)};
  e.farSum = {sumOf(farSum.x), sumOf(farSum.y)};
  e.product = static_cast<double>(sumOf(product));
  e.rays = static_cast<std::uint32_t>(rays[0] + rays[1] + rays[2] + rays[3]);
  e.sag = leastOf(sag);
  return e;
}

}  // namespace

std::vector<ClusterExtents> findExtents(const Clustering& clustering,
                                        std::span<const std::uint8_t> curved,
                                        std::span<const ClusterFrame> frames, float depth) {
  const std::vector<Cluster>& clusters = clustering.clusters();
  const std::span<const SampleBlock> blocks = clustering.blocks();
  std::vector<std::vector<ClusterExtents>> extents(blocks.size());
  parallelFor(blocks.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b) {
      const SampleBlock& block = blocks[b];
      extents[b].resize(block.slots.size());
      for (const SampleRun& run : block.runs) {
        const std::size_t c = block.slots[run.slot];
        if (curved[c] == 0) continue;
        extents[b][run.slot].add(extentsOf(block, run, clusters[c].centroid, frames[c], depth));
      }
    }
  });
  std::vector<ClusterExtents> all(clusters.size());
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    for (std::size_t s = 0; s < extents[b].size(); ++s) {
      all[blocks[b].slots[s]].add(extents[b][s]);
    }
  }
  return all;
}

}  // namespace catoptric::methods::second_order
