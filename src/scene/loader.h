// Loads scenes: glTF 2.0 (.gltf, .glb) and scene descriptions (.json).
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <vector>

#include "scene/daylight.h"
#include "scene/scene.h"

namespace catoptric::scene {

/// Largest coordinate in metres. Beyond it the squares of areas would overflow floats; Embree
/// aborts at 1e18. Our choice.
inline constexpr float kMaxCoordinate = 1e9f;
/// Largest component of a colour in a file, such as the colour of a light in a glTF file. Our
/// choice.
inline constexpr float kMaxColor = 1e9f;
/// Largest radiance (W/(m^2 sr)) or intensity of a light, material or environment, after its colour
/// is multiplied by its strength. Our choice: rendering can still add and multiply by up to 10^5
/// before floats overflow.
inline constexpr float kMaxRadiance = 1e33f;
/// Maximum number of unbaked lights. Each takes 48 bytes of the 16 KiB uniform block that GL
/// guarantees.
inline constexpr std::size_t kMaxUnbakedLights = 256;

/// Limits that keep hostile or mistaken input from exhausting the machine.
struct LoadLimits {
  std::size_t maxBytes = std::size_t{4} << 30;  ///< geometry and textures in memory, while loading
  std::size_t maxFileBytes = std::size_t{1} << 30;
  std::size_t maxTexturePixels = std::size_t{1} << 26;
  std::size_t maxNodes = 1'000'000;
  bool showMissingTextures = false;  ///< of glTF files: a checkerboard and a warning, no error
  std::vector<std::filesystem::path> assetFolders = {};  ///< see assetFile()
};

/// The default limits. The environment variable CATOPTRIC_SCENE_MIB, if set, determines maxBytes.
/// Throws UsageError if it is not a whole number from 1 to 1048576.
LoadLimits limitsOfEnvironment();

/// The file `name` that a file of the scene in `folder` names: there or below, else in the first of
/// limits.assetFolders that has it. A name that leads out of `folder` must lead into one of these.
/// Empty: it does not.
std::filesystem::path assetFile(const std::filesystem::path& folder,
                                const std::filesystem::path& name, const LoadLimits& limits);
/// Ends the message of a missing asset.
inline constexpr const char* kAssetHint = "; --asset-path FOLDER names folders to look in";

/// Loads and checks a scene. `environment`, if given, replaces the scene's own; without it a glTF
/// file that has no lights gets daylight. `ground` is for glTF files. Throws SceneError, which
/// names the file, the place (with a JSON pointer where there is one), the value and what is
/// allowed.
Scene loadScene(const std::filesystem::path& file, const LoadLimits& limits = limitsOfEnvironment(),
                const std::optional<Environment>& environment = {}, Ground ground = Ground::None);

/// Loads a glTF file alone; scene descriptions also use it for their assets.
Scene loadGltf(const std::filesystem::path& file, const LoadLimits& limits = {});

/// Loads a scene description (.json) alone.
Scene loadDescription(const std::filesystem::path& file, const LoadLimits& limits = {});

}  // namespace catoptric::scene
