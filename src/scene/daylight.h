// The light and the ground of a glTF file that is rendered on its own.
#pragma once

#include "scene/scene.h"

namespace catoptric::scene {

/// The default environment of a glTF file without lights: a soft sky over a darker ground, without
/// a colour cast that would hide the colours of materials. Our choice.
Environment defaultEnvironment();

/// Lights a scene that has no light by a dimmer default environment and by a sun. Unless something
/// moves, their light is baked: the sun casts shadows, and surfaces occlude the sky.
void addDaylight(Scene& scene);

enum class Ground : std::uint8_t { None, Matte, Mirror };

/// Adds a wide plane below the lowest point of the scene, as its last object, and bakes all light
/// so that the plane receives shadows.
void addGround(Scene& scene, Ground ground);

}  // namespace catoptric::scene
