// Camera path descriptions: their schema, and loading from a parsed value.
#pragma once

#include <memory>

#include "config/json.h"
#include "scene/camera.h"

namespace catoptric::scene {

/// The schema of path descriptions, for validation, configs/schema/path.schema.json and docs.
const config::Schema& pathSchema();

/// See loadPath(); reads from a parsed value.
std::unique_ptr<CameraPath> makePath(const config::Value& description, const Scene& scene);

}  // namespace catoptric::scene
