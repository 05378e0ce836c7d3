#include "core/error.h"
#include "core/parallel.h"
#include "memory_file.h"
#include "scene/animate.h"
#include "scene/finish.h"
#include "scene/loader.h"

using namespace catoptric;

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  setThreadCount(1);
  const fuzz::MemoryFile file(data, size);
  scene::LoadLimits limits;
  limits.maxBytes = std::size_t{1} << 28;
  limits.maxNodes = 1000;
  try {
    scene::Scene scene = scene::loadDescription(file.path(), limits);
    scene::finishScene(scene);
    scene::checkScene(scene);
    const scene::Pose pose = scene::poseAt(scene, 0.5);
    for (const scene::Object& object : scene.objects) scene::worldVertices(scene, object, pose);
  } catch (const Error&) {
  }
  return 0;
}
