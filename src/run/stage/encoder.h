// The files of a frame: its EXR and its preview.
#pragma once

#include "run/config/run_config.h"
#include "run/sequence/sequence.h"

namespace catoptric::run {

/// Encodes frames of `run` as EXR and preview, for runSequence(). `origin` of the scene, so that
/// the camera of the files is in the coordinates of the scene's file.
Encoder makeEncoder(const RunConfig& run, const MethodConfig& method, const glm::dvec3& origin);

}  // namespace catoptric::run
