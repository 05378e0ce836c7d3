// Environments that a run names.
#pragma once

#include <filesystem>

#include "config/json.h"
#include "scene/scene.h"

namespace catoptric::scene {

/// An environment from its text: "sky" (the default), a colour "#rrggbb" (sRGB) or "r,g,b"
/// (radiance, scene-linear), or an image, whose path is `file`. Throws UsageError with the text's
/// place.
Environment namedEnvironment(const config::Value& text, const std::filesystem::path& file);

}  // namespace catoptric::scene
