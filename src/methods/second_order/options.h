// The method's options, as a run config has them.
#pragma once

#include "config/options.h"
#include "methods/second_order/cameras/cluster_camera.h"
#include "methods/second_order/clustering/types.h"
#include "methods/second_order/depth_images/depth_images.h"

namespace catoptric::methods {

/// Which rays are intersected with their own object's samples, too; as SELF of shaders/rays.frag.
enum class SelfIntersect : int { None, OfConcaveClusters, OfAllButPlanarMirrors };

/// How the rays of a lobe are followed.
enum class LobeRays { Walked, LookedUpAtTheCentresDistance };

struct SecondOrderOptions {
  ClusterOptions cluster;
  CameraOptions camera;
  DepthImageOptions images;
  int faceSize = 256;  ///< of the cube map, texels
  SelfIntersect selfIntersect = SelfIntersect::None;
  LobeRays lobeRays = LobeRays::Walked;
  float glossyReach = 0.0f;  ///< metres times (1 - g) / g; 0: as far as the scene
  bool countDisocclusions = false;
};

const config::OptionTable<SecondOrderOptions>& secondOrderOptions();

}  // namespace catoptric::methods
