// The method's options, as a run config has them.
#pragma once

#include "config/options.h"
#include "methods/second_order/cameras/cluster_camera.h"
#include "methods/second_order/clustering/types.h"
#include "methods/second_order/depth_images/depth_images.h"
#include "trace/embree/trace_scene.h"

namespace catoptric::methods::second_order {

/// Which rays are intersected with their own object's samples, too; as SELF of shaders/rays.frag.
enum class SelfIntersect : int { None, OfConcaveClusters, OfAllButPlanarMirrors };

/// How the rays of a lobe are followed.
enum class LobeRays { Walked, LookedUpAtTheCentresDistance };

struct Options {
  ClusterOptions cluster;
  CameraOptions camera;
  DepthImageOptions images;
  int faceSize = 256;  ///< of the cube map, texels
  SelfIntersect selfIntersect = SelfIntersect::None;
  LobeRays lobeRays = LobeRays::Walked;
  float glossyReach = 0.0f;  ///< metres times (1 - g) / g; 0: as far as the scene
  int probes = 16;           ///< samples of a curved cluster; 0: nothing is traced
  float probeError = 4.0f;   ///< of 255 steps, from which on it is traced
  trace::BvhPolicy bvh = trace::BvhPolicy::Static;
  // No options; ours, measured in experiments.md. Tests change them.
  int leastImageRays = 8192;   ///< of a probed cluster whose image costs less than tracing it
  float selfHitShare = 0.06f;  ///< of probes that meet their own object, from which on it is traced
};

const config::OptionTable<Options>& optionTable();

}  // namespace catoptric::methods::second_order
