// Several methods in one frame: each shades the reflectors that the run config assigns to it.
// Reflectors that their method does not support go to the method that `unsupported` names. There is
// one G-buffer and one composite.
#pragma once

#include <memory>
#include <vector>

#include "methods/contract/method.h"
#include "run/config/run_config.h"
#include "scene/scene.h"

namespace catoptric::run {

/// Makes the method of one entry of `methods` for this scene: the registry's method, or a mixture
/// if some reflectors are assigned to other methods. Throws UsageError, with the place in the
/// config, for names that match no reflector and for methods that cannot share a frame.
std::unique_ptr<methods::Method> makeMethod(const MethodConfig& config, const scene::Scene& scene,
                                            const methods::RunSettings& settings,
                                            const std::vector<methods::MethodEntry>& registry);

}  // namespace catoptric::run
