// What kind of reflector an object is to this method.
#pragma once

#include <cstdint>
#include <string>

#include "scene/scene.h"

namespace catoptric::methods::perturbation {

enum class Kind : std::uint8_t { Diffuse, Planar, Implicit, Unsupported };

/// `reason`: why it is not supported.
Kind kindOf(const scene::Scene& scene, const scene::Object& object, std::string& reason);

}  // namespace catoptric::methods::perturbation
