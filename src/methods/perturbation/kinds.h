// Classifies reflectors for this method.
#pragma once

#include <cstdint>
#include <string>

#include "scene/scene.h"

namespace catoptric::methods::perturbation {

enum class Kind : std::uint8_t { Diffuse, Planar, Implicit, Unsupported };

/// `reason` is set to why an object is not supported.
Kind kindOf(const scene::Scene& scene, const scene::Object& object, std::string& reason);

}  // namespace catoptric::methods::perturbation
