// What of a scene reflects, as this method sees it.
#pragma once

#include <vector>

#include "methods/contract/method.h"
#include "methods/second_order/clustering/types.h"
#include "methods/shared/reflectors.h"
#include "scene/scene.h"

namespace catoptric::methods::second_order {

struct SceneReflectors : Reflectors {
  std::vector<ReflectorKind> kinds;  ///< by object id
  std::vector<bool> skipOwn;         ///< by object id: flat, hence never seen in itself
  std::vector<float> weight;         ///< by object id: of its reflections, at most
  bool levelsVary = false;           ///< s comes from a texture: some samples may not reflect

  /// By object id: how far the rays of its lobes go, metres, as shaders/rays.frag has it for
  /// `glossyReach`; 0 where g varies over the object.
  std::vector<float> reach(const scene::Scene& scene, float glossyReach) const;
};

/// Those that the method fills.
SceneReflectors findSceneReflectors(const scene::Scene& scene, const RunSettings& settings);

}  // namespace catoptric::methods::second_order
