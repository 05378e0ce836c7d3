// Loading scenes: glTF 2.0 (.gltf, .glb) and scene descriptions (.json).
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>

#include "scene/scene.h"

namespace catoptric::scene {

/// Metres. Beyond it the squares of areas would overflow floats; Embree aborts at 1e18. Ours.
inline constexpr float kMaxCoordinate = 1e9f;
/// The largest component of a colour as it is given. Ours: that of a light's colour in a glTF file.
inline constexpr float kMaxColor = 1e9f;
/// The largest radiance (W/(m^2 sr)) or intensity that anything gives, its factors multiplied.
/// Ours: it leaves five decimal digits of single precision to sums and products of rendering.
inline constexpr float kMaxRadiance = 1e33f;
/// Lights that are evaluated at run time, at 48 bytes each in the 16 KiB block that GL guarantees.
inline constexpr std::size_t kMaxUnbakedLights = 256;

/// Caps that keep hostile or mistaken input from exhausting the machine.
struct LoadLimits {
  std::size_t maxBytes = std::size_t{4} << 30;  ///< geometry and textures in memory, while loading
  std::size_t maxFileBytes = std::size_t{1} << 30;
  std::size_t maxTexturePixels = std::size_t{1} << 26;
  std::size_t maxNodes = 1'000'000;
};

/// The defaults, with maxBytes from the environment variable CATOPTRIC_SCENE_MIB where it is set.
/// Throws UsageError when that is no whole number from 1 to 1048576.
LoadLimits limitsOfEnvironment();

/// Loads and checks a scene. A glTF file without lights gets the default environment; `environment`
/// takes the place of any scene's own. Throws SceneError that names file, place (JSON pointer where
/// it has one), value and what is allowed.
Scene loadScene(const std::filesystem::path& file, const LoadLimits& limits = limitsOfEnvironment(),
                const std::optional<Environment>& environment = {});

/// glTF alone; also used by scene descriptions for their assets.
Scene loadGltf(const std::filesystem::path& file, const LoadLimits& limits = {});

/// A scene description (.json) alone.
Scene loadDescription(const std::filesystem::path& file, const LoadLimits& limits = {});

}  // namespace catoptric::scene
