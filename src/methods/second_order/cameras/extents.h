// What equation (1) of [Wang2014] needs of a cluster: where its rays pass the image plane and the
// far plane.
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "methods/second_order/cameras/frame.h"
#include "methods/second_order/clustering/clusters.h"

namespace catoptric::methods::second_order {

/// What equation (1) needs, over a cluster's samples.
struct ClusterExtents {
  SampleRect near;  ///< aabb_n on the image plane
  SampleRect far;   ///< of the far ends on the far plane
  glm::dvec2 nearSum{0.0}, farSum{0.0};
  double product = 0.0;  ///< sum of near . far
  std::uint32_t rays = 0;
  float sag = std::numeric_limits<float>::infinity();  ///< least offset along the axis

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

/// ClusterExtents of the curved clusters' samples, seen from their mirrored eyes; the far plane
/// lies `depth` metres behind the image plane. The same for any number of threads.
std::vector<ClusterExtents> findExtents(const Clustering& clustering,
                                        std::span<const std::uint8_t> curved,
                                        std::span<const ClusterFrame> frames, float depth);

}  // namespace catoptric::methods::second_order
