// The camera of a planar mirror's cluster.
#pragma once

#include "methods/second_order/cameras/cluster_camera.h"

namespace catoptric::methods::second_order {

/// Mirrors the frame's camera at the cluster's plane. If the option depth_image_scale is 1, the
/// depth image has one texel at each sample of the frame.
ClusterCamera planarCamera(const Cluster& cluster, const scene::Camera& camera, int sampleWidth,
                           int sampleHeight, const CameraOptions& options);

}  // namespace catoptric::methods::second_order
