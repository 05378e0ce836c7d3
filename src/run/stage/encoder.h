// Makes the files of a frame: its EXR and its preview.
#pragma once

#include "run/config/run_config.h"
#include "run/sequence/sequence.h"

namespace catoptric::run {

/// Encodes frames of `run` as EXR and preview, for runSequence(). `origin`: Scene::origin; with it,
/// camera attributes are written in the coordinates of the scene's file.
Encoder makeEncoder(const RunConfig& run, const MethodConfig& method, const glm::dvec3& origin);

}  // namespace catoptric::run
