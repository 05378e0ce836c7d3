// Camera path descriptions: their schema, and loading from a parsed value.
#pragma once

#include <memory>

#include "config/json.h"
#include "scene/camera.h"

namespace catoptric::scene {

/// The path description's table: validation, configs/schema/path.schema.json, docs.
const config::Schema& pathSchema();

/// As loadPath, from a value.
std::unique_ptr<CameraPath> makePath(const config::Value& description, const Scene& scene);

}  // namespace catoptric::scene
