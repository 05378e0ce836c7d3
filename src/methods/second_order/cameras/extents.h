// The input of [Wang2014] equation (1): where a cluster's rays cross the image and far planes.
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "methods/second_order/cameras/frame.h"
#include "methods/second_order/clustering/clusters.h"

namespace catoptric::methods::second_order {

/// Extents and sums over a cluster's samples.
struct ClusterExtents {
  SampleRect near;  ///< aabb_n on the image plane
  SampleRect far;   ///< aabb of the rays' far ends on the far plane
  glm::dvec2 nearSum{0.0}, farSum{0.0};
  /// Sum over the rays of the dot product of their points on the image plane and on the far plane.
  double product = 0.0;
  std::uint32_t rays = 0;
  /// Smallest offset of a sample from P_c along the image's axis, in metres.
  float sag = std::numeric_limits<float>::infinity();

  void add(const ClusterExtents& e) {
    near.extend(e.near);
    far.extend(e.far);
    nearSum += e.nearSum;
    farSum += e.farSum;
    product += e.product;
    rays += e.rays;
    sag = std::min(sag, e.sag);
  }
};

/// ClusterExtents of the curved clusters, seen from their mirrored eyes. The far plane lies `depth`
/// metres behind the image plane. The result does not depend on the number of threads.
std::vector<ClusterExtents> findExtents(const Clustering& clustering,
                                        std::span<const std::uint8_t> curved,
                                        std::span<const ClusterFrame> frames, float depth);

}  // namespace catoptric::methods::second_order
