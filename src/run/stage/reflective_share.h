// How much of a picture reflects.
#pragma once

#include "scene/scene.h"

namespace catoptric::run {

/// The part of the first frame, 0..1, that shows reflective objects, seen by the scene's own
/// camera.
double reflectiveShare(const scene::Scene& scene);

}  // namespace catoptric::run
