#include <cmath>
#include <memory>

#include "config/json.h"
#include "core/error.h"
#include "memory_file.h"
#include "scene/camera.h"
#include "scene/paths/path.h"
#include "scene/scene.h"

using namespace catoptric;

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  scene::Scene scene;
  scene.cameras.push_back({.name = "front", .node = 0});
  scene.nodes.emplace_back();
  try {
    const config::Value root =
        config::parseText({reinterpret_cast<const char*>(data), size}, "fuzz.json");
    const std::unique_ptr<scene::CameraPath> path = scene::makePath(root, scene);
    for (const int number : {1, path->count()}) {
      const scene::PathFrame frame = path->frame(number);
      for (int column = 0; column < 4; ++column) {
        // What is accepted is a camera
        if (!isFinite(Vec3(frame.camera.worldFromCamera[column]))) std::abort();
      }
    }
  } catch (const Error&) {
  }
  return 0;
}
