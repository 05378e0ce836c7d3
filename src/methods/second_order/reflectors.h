// The reflectors of a scene, as this method classifies them.
#pragma once

#include <vector>

#include "methods/contract/method.h"
#include "methods/second_order/clustering/types.h"
#include "methods/shared/reflectors.h"
#include "scene/scene.h"

namespace catoptric::methods::second_order {

struct SceneReflectors : Reflectors {
  std::vector<ReflectorKind> kinds;  ///< by object id
  std::vector<bool> skipOwn;         ///< by object id: flat, so that it cannot reflect itself
  std::vector<float> weight;         ///< by object id: maximum weight of its reflections
  bool levelsVary = false;           ///< s comes from a texture: some samples may not reflect

  /// By object id: maximum length in metres of its lobe's rays, from `glossyReach` as in
  /// shaders/rays.frag; 0 if g varies over the object.
  std::vector<float> reach(const scene::Scene& scene, float glossyReach) const;
};

/// The reflectors that the method shades.
SceneReflectors findSceneReflectors(const scene::Scene& scene, const RunSettings& settings);

}  // namespace catoptric::methods::second_order
