// The camera of a planar mirror's cluster.
#pragma once

#include "methods/second_order/cameras/cluster_camera.h"

namespace catoptric::methods::second_order {

/// Makes the mirrored camera with its own sample grid.
ClusterCamera planarCamera(const Cluster& cluster, const scene::Camera& camera, int sampleWidth,
                           int sampleHeight, const CameraOptions& options);

}  // namespace catoptric::methods::second_order
