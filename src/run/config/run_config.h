// Run configs: the scene, camera path, image settings and methods of a run. A config is one JSON
// file. Every value is checked against a schema before anything is loaded.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "config/json.h"
#include "config/json_text.h"
#include "core/input_files.h"
#include "image/image.h"
#include "methods/contract/method.h"
#include "run/config/method_config.h"
#include "scene/daylight.h"
#include "scene/scene.h"

namespace catoptric::run {

struct PreviewConfig {
  bool enabled = true;
  float exposureStops = 0.0f;
  std::string view;            ///< empty: Neutral, or the first one of `ocio`
  std::filesystem::path ocio;  ///< empty: the built-in config
  std::string ocioReference;   ///< where `ocio` is named

  image::DisplayView shown() const {
    return {ocio, view.empty() && ocio.empty() ? image::kNeutralView : view, exposureStops};
  }
};

/// What `catoptric sweep` measures with this config. Command-line options override it.
struct SweepConfig {
  std::vector<std::string> vary;  ///< as the option --vary; so are the other members
  std::vector<std::string> link;
  std::vector<std::string> where;
  std::vector<std::string> metrics = {"L1_8bit"};
  std::string against;
  std::string ratioTo;
  int repeats = 8;
};

struct RunConfig {
  std::string name;             ///< the config's file name without folder and extension
  std::filesystem::path file;   ///< the config, or a scene file given without a config
  std::filesystem::path scene;  ///< .gltf, .glb, or a description
  std::string sceneReference;   ///< where the scene is named: config, line, pointer
  std::filesystem::path path;   ///< camera path; empty: `camera`
  std::string pathReference;    ///< where the path is named
  std::string camera;           ///< see scene::cameraPath()
  std::string cameraReference;  ///< where the camera is named
  std::optional<scene::Environment> environment;  ///< replaces the scene's own
  scene::Ground ground = scene::Ground::None;
  bool showMissingTextures = false;                 ///< see scene::LoadLimits
  std::vector<std::filesystem::path> assetFolders;  ///< see scene::LoadLimits
  std::string frames;                               ///< empty: all frames of the path
  methods::RunSettings image;
  image::Compression compression = image::Compression::Zip;
  bool halfBeauty = true;
  PreviewConfig preview;
  SweepConfig sweep;
  std::vector<MethodConfig> methods;
  std::vector<std::string> errorsAgainst;  ///< names in `methods`
  std::vector<std::string>
      errorsDropped;  ///< methods of errors.against that the config has but the run does not render
  std::string device = "auto";
  int threads = 0;
  std::string effective;  ///< canonical JSON of the whole config, with defaults
  InputFiles inputs;      ///< the config's file

  /// The part of `effective` that determines the pixels or bytes of one method's frames.
  std::string pixelSettings(const MethodConfig& method) const;
};

/// The schema of run configs, without the methods' own options.
const config::Schema& runSchema();
/// Checks and reads a run config; its paths are relative to its file. Throws one UsageError with
/// all errors, one per line. If `methods` is not empty, these methods are run instead of the
/// config's; a name that the config contains keeps its options.
RunConfig readRunConfig(const config::Value& root, const std::filesystem::path& file,
                        const std::vector<methods::MethodEntry>& registry,
                        const std::vector<std::string>& methods = {});

/// The config that is used for a scene given without a config: the scene's own camera, and these
/// methods with their defaults.
config::Value configOfScene(const std::filesystem::path& scene,
                            const std::vector<std::string>& methods);

/// The kind of a JSON file, recognised by the names of its members.
enum class FileKind { Unknown, RunConfig, Scene, Path };
FileKind fileKind(const config::Value& root);

/// Whether `file` is a scene instead of a run config: .gltf, .glb, or JSON with "objects".
bool isScene(const std::filesystem::path& file);

}  // namespace catoptric::run
