// The method's options.
#pragma once

#include "config/options.h"
#include "methods/second_order/cameras/cluster_camera.h"
#include "methods/second_order/clustering/types.h"
#include "methods/second_order/depth_images/depth_images.h"
#include "trace/embree/trace_scene.h"

namespace catoptric::methods::second_order {

/// Which rays are also intersected with their own object; the values of SELF in shaders/rays.frag.
enum class SelfIntersect : int { None, OfConcaveClusters, OfAllButPlanarMirrors };

/// How the rays of a lobe are intersected.
enum class LobeRays { Walked, LookedUpAtTheCentresDistance };

struct Options {
  ClusterOptions cluster;
  CameraOptions camera;
  DepthImageOptions images;
  int faceSize = 256;  ///< texels along a cube map's edge
  SelfIntersect selfIntersect = SelfIntersect::None;
  LobeRays lobeRays = LobeRays::Walked;
  float glossyReach = 0.0f;  ///< see `glossy_reach`; 0: no fading
  int probes = 16;           ///< probed samples per curved cluster; 0: nothing is traced
  float probeError = 4.0f;   ///< in 8-bit values; clusters with a larger error are traced
  trace::BvhPolicy bvh = trace::BvhPolicy::Static;
  // Neither options nor in the paper; measured in experiments.md. Tests change these two.
  /// Probed clusters with fewer rays are traced: a depth image would cost more.
  int leastImageRays = 8192;
  float selfHitShare = 0.06f;  ///< a cluster with a larger fraction of self-hits is traced
};

const config::OptionTable<Options>& optionTable();

}  // namespace catoptric::methods::second_order
