// Run configs: what is rendered, from where, how large, by which methods. One JSON file; every
// value is checked against a schema before anything is loaded.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "config/json.h"
#include "config/json_text.h"
#include "image/image.h"
#include "methods/contract/method.h"
#include "scene/scene.h"

namespace catoptric::run {

/// A member of an entry's `reflectors`: the method that fills some reflective objects.
struct ReflectorRule {
  std::string pattern;    ///< an object's name, or with a trailing * the beginning of names
  std::string id;         ///< in the registry
  config::Value options;  ///< checked against the method's schema
  std::string effective;  ///< canonical JSON of the options, defaults filled in
  config::Value place;    ///< for messages
};

/// One entry of `methods`: a method with its options, under a name of its own.
struct MethodConfig {
  std::string name;       ///< folder of its frames, row of its tables
  std::string id;         ///< in the registry
  config::Value options;  ///< checked against the method's schema
  std::string effective;  ///< canonical JSON of the options, defaults filled in
  std::vector<ReflectorRule> reflectors = {};  ///< others are filled by the method itself
  /// What fills reflectors that their method cannot do: "error" (none), or a method's id.
  std::string unsupported = "error";

  /// Adds what makes the method's pixels: method, options, reflectors, unsupported.
  void addSettings(config::JsonText& text) const;
};

struct PreviewConfig {
  bool enabled = true;
  float exposureStops = 0.0f;
};

/// What `catoptric sweep` measures of this config; its options are stronger.
struct SweepConfig {
  std::vector<std::string> vary;  ///< as for --vary, and so on
  std::vector<std::string> link;
  std::vector<std::string> where;
  std::vector<std::string> metrics = {"L1_8bit"};
  std::string against;
  std::string ratioTo;
  int repeats = 8;
};

struct RunConfig {
  std::string name;             ///< the config's file name without folder and extension
  std::filesystem::path file;   ///< the config, or the bare scene
  std::filesystem::path scene;  ///< .gltf, .glb, or a description
  std::string sceneReference;   ///< where the scene is named: config, line, pointer
  std::filesystem::path path;   ///< camera path; empty: the scene's own camera
  std::string pathReference;    ///< where the path is named
  std::optional<scene::Environment> environment;  ///< in place of the scene's own
  std::string frames;                             ///< empty: all frames of the path
  methods::RunSettings image;
  image::Compression compression = image::Compression::Zip;
  bool halfBeauty = true;
  PreviewConfig preview;
  SweepConfig sweep;
  std::vector<MethodConfig> methods;
  std::vector<std::string> errorsAgainst;  ///< names in `methods`
  std::vector<std::string> errorsDropped;  ///< others that the config names, which are not run
  std::string device = "auto";
  int threads = 0;
  std::string effective;  ///< canonical JSON of everything, defaults filled in

  /// The part of `effective` that changes the pixels or bytes of one method's frames.
  std::string pixelSettings(const MethodConfig& method) const;
};

/// Schema of run configs without the methods' own options.
const config::Schema& runSchema();
/// Methods that may fill what another one cannot do.
std::vector<std::string> fallbackMethods();
/// Schema of one entry of `methods`: name, method, and the method's own options.
config::Schema methodSchema(const methods::MethodEntry& entry);

/// Checks and reads a run config; paths in it are relative to its file. All errors are collected
/// into one UsageError, a line each. `methods` non-empty: run these instead of the config's; a name
/// that the config has keeps its options.
RunConfig readRunConfig(const config::Value& root, const std::filesystem::path& file,
                        const std::vector<methods::MethodEntry>& registry,
                        const std::vector<std::string>& methods = {});

/// The config that stands for a bare scene: its own camera, these methods with their defaults.
config::Value configOfScene(const std::filesystem::path& scene,
                            const std::vector<std::string>& methods);

/// What a JSON file describes, by its names.
enum class FileKind { Unknown, RunConfig, Scene, Path };
FileKind fileKind(const config::Value& root);

/// True when `file` is a scene and no run config: .gltf, .glb, or JSON with "objects".
bool isScene(const std::filesystem::path& file);

}  // namespace catoptric::run
