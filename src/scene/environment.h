// Environments that a run names, or gets where its scene has no light.
#pragma once

#include <filesystem>

#include "config/json.h"
#include "scene/scene.h"

namespace catoptric::scene {

/// A soft sky over a darker ground, without colour casts that hide a material's own: what a glTF
/// file without lights is shown in. Ours.
Environment defaultEnvironment();

/// An environment by its text: "sky" (the default), a colour "#rrggbb" (sRGB) or "r,g,b" (radiance,
/// scene-linear), or an image, which is `file`. Throws UsageError with the text's place.
Environment namedEnvironment(const config::Value& text, const std::filesystem::path& file);

}  // namespace catoptric::scene
