// Several methods share a frame: each fills the reflectors that a run config gives it, and those
// that their method cannot do go to the one that `unsupported` names. One G-buffer, one composite.
#pragma once

#include <memory>
#include <vector>

#include "methods/contract/method.h"
#include "run/config/run_config.h"
#include "scene/scene.h"

namespace catoptric::run {

/// The method of one entry of `methods` for this scene: that of the registry, or a mixture where
/// reflectors go to others. Throws UsageError, with its place in the config, for names that are no
/// reflectors' and for methods that cannot share a frame.
std::unique_ptr<methods::Method> makeMethod(const MethodConfig& config, const scene::Scene& scene,
                                            const methods::RunSettings& settings,
                                            const std::vector<methods::MethodEntry>& registry);

}  // namespace catoptric::run
