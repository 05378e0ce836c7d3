#include "scene/loader.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cstdlib>
#include <string_view>

#include "core/error.h"
#include "scene/finish.h"

namespace catoptric::scene {

LoadLimits limitsOfEnvironment() {
  LoadLimits limits;
  const char* value = std::getenv("CATOPTRIC_SCENE_MIB");
  if (value == nullptr || *value == '\0') return limits;
  const std::string_view text(value);
  std::size_t mebibytes = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), mebibytes);
  if (error != std::errc() || end != text.data() + text.size() || mebibytes < 1 ||
      mebibytes > (std::size_t{1} << 20)) {
    throw UsageError("CATOPTRIC_SCENE_MIB=\"" + std::string(text.substr(0, 80)) +
                     "\": must be a whole number from 1 to 1048576");
  }
  limits.maxBytes = mebibytes << 20;
  return limits;
}

std::filesystem::path assetFile(const std::filesystem::path& folder,
                                const std::filesystem::path& name, const LoadLimits& limits) {
  namespace fs = std::filesystem;
  const auto inside = [](const fs::path& relative) {
    return !relative.empty() && relative.is_relative() && *relative.begin() != "..";
  };
  std::error_code ignored;
  const fs::path inner = name.lexically_normal();
  if (inside(inner)) {
    if (!fs::exists(folder / inner, ignored))
      for (const fs::path& other : limits.assetFolders)
        if (fs::exists(other / inner, ignored)) return other / inner;
    return folder / inner;
  }
  fs::path whole = fs::absolute(folder / name).lexically_normal();
  for (const fs::path& other : limits.assetFolders)
    if (inside(whole.lexically_relative(fs::absolute(other).lexically_normal()))) return whole;
  return {};
}

Scene loadScene(const std::filesystem::path& file, const LoadLimits& limits,
                const std::optional<Environment>& environment, Ground ground) {
  std::string extension = file.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  Scene scene;
  if (extension == ".gltf" || extension == ".glb") {
    scene = loadGltf(file, limits);
    scene.highlights = true;
    letDielectricsReflect(scene);
    if (environment) {
      scene.environment = *environment;
    } else if (scene.lights.empty()) {
      addDaylight(scene);
    }
    addGround(scene, ground);
  } else if (extension == ".json") {
    if (ground != Ground::None)
      throw SceneError(file.string() +
                       ": is a description, which gets no ground; add a plane to it");
    scene = loadDescription(file, limits);
    if (environment) scene.environment = *environment;
  } else {
    std::error_code error;
    if (std::filesystem::is_directory(file, error))
      throw SceneError(file.string() + ": is a folder; give a file (.json, .gltf, .glb)");
    throw SceneError(file.string() + ": \"" + extension +
                     "\" is not a kind of scene; the kinds are .json, .gltf and .glb");
  }
  finishScene(scene);
  checkScene(scene);
  return scene;
}

}  // namespace catoptric::scene
