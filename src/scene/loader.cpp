#include "scene/loader.h"

#include <algorithm>
#include <cctype>

#include "core/error.h"

namespace catoptric::scene {

Scene loadScene(const std::filesystem::path& file, const LoadLimits& limits) {
  std::string extension = file.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  Scene scene;
  if (extension == ".gltf" || extension == ".glb") {
    scene = loadGltf(file, limits);
  } else if (extension == ".json") {
    scene = loadDescription(file, limits);
  } else {
    throw SceneError(file.string() + ": \"" + extension +
                     "\" is no kind of scene: .json, .gltf and .glb are");
  }
  finishScene(scene);
  return scene;
}

}  // namespace catoptric::scene
