#include "app/run_options.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdio>
#include <fstream>
#include <set>

#include "config/json_text.h"
#include "core/log.h"
#include "core/nearest_file.h"
#include "core/parallel.h"
#include "core/text.h"
#include "methods/contract/method.h"

namespace catoptric::app {
namespace {

constexpr const char* kStandardInput = "-";

/// Whether a file may be JSON or glTF, by its name or its first character.
bool mayBeInput(const std::filesystem::path& file) {
  std::string extension = file.extension().string();
  std::ranges::transform(extension, extension.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (extension == ".json" || extension == ".gltf" || extension == ".glb") return true;
  std::ifstream stream(file);
  char first = '{';
  stream >> first;
  return first == '{';
}

/// Throws if the input is no file that could be a config or a scene; names the nearest one.
void requireInput(const std::string& input) {
  namespace fs = std::filesystem;
  const fs::path path = input;
  std::error_code error;
  if (fs::is_regular_file(path, error)) {
    if (mayBeInput(path)) return;
    throw UsageError(input +
                     ": is neither a run config nor a scene; scenes are .json, .gltf and .glb "
                     "(export models of other programs as glTF)");
  }
  if (fs::is_directory(path, error))
    throw UsageError(input + ": is a folder; give a run config or a scene (.json, .gltf, .glb)");
  if (fs::exists(path, error))
    throw UsageError(input + ": is not a regular file; give a run config or a scene");
  const fs::path nearest = nearestFile(path);
  const std::string message =
      input + ": no such file" +
      (nearest.empty()
           ? "; `catoptric list scenes configs` lists files that can be given by their names alone"
           : " (did you mean \"" + nearest.string() + "\"?)");
  if (path.extension() == ".gltf" || path.extension() == ".glb") throw SceneError(message);
  throw UsageError(message);
}

/// What stands on standard input. Throws UsageError when it is too much for a config.
std::string standardInput() {
  constexpr std::size_t kMost = 64u << 20;  // as of a config's file
  std::string text;
  std::array<char, 65536> part{};
  while (const std::size_t n = std::fread(part.data(), 1, part.size(), stdin)) {
    text.append(part.data(), n);
    if (text.size() > kMost)
      throw UsageError("standard input: larger than 64 MiB, too large for a run config");
  }
  return text;
}

/// The whole names of a method's option, where `path` does not say whose it is: of the config's
/// methods that have it.
std::string methodOptionHint(const config::Value& root, const std::string& path) {
  const std::string name = path.substr(path.rfind('.') + 1);
  const auto hasOption = [&](const std::string& id) {
    const methods::MethodEntry* entry = methods::findMethod(methods::registry(), id);
    return entry != nullptr &&
           std::ranges::find(entry->options.fields, name, &config::Field::name) !=
               entry->options.fields.end();
  };
  std::vector<std::string> forms;
  const config::Value methods = root.get("methods");
  if (methods.kind() == config::Value::Kind::Array)
    for (const config::Value& method : methods.asArray()) {
      const bool isName = method.kind() == config::Value::Kind::String;
      const config::Value id = isName ? method : method.get("method");
      const config::Value own = !isName && method.has("name") ? method.get("name") : id;
      if (id.kind() == config::Value::Kind::String && own.kind() == config::Value::Kind::String &&
          hasOption(id.asString()))
        forms.push_back("methods." + own.asString() + "." + name);
    }
  return joined(forms, " or ");
}

/// Names that the config cannot have, with the right form where it is a method's option.
void checkSettingName(const config::Value& root, const std::string& path) {
  const std::string first = path.substr(0, path.find('.'));
  for (const config::Field& field : run::runSchema().fields)
    if (field.name == first) return;
  const std::string hint = methodOptionHint(root, path);
  if (!hint.empty()) throw UsageError("\"" + path + "\" is an option of a method; name it " + hint);
}

/// Changes one value. A method is named by its number or its name in the config. It and its
/// fallback get options also where the config gives their names alone.
config::Value changed(const config::Value& root, const std::string& path,
                      const std::string& value) {
  constexpr std::string_view kMethods = "methods.";
  constexpr std::string_view kFallback = ".fallback.";
  const config::Value methods = root.get("methods");
  const std::size_t dot = path.find('.', kMethods.size());
  checkSettingName(root, path);
  if (!path.starts_with(kMethods) || dot == std::string::npos ||
      methods.kind() != config::Value::Kind::Array)
    return config::withSetting(root, path, value);

  std::string chosen = path.substr(kMethods.size(), dot - kMethods.size());
  std::vector<std::string> names;
  std::string shorthand;
  std::string fallback;
  for (const config::Value& method : methods.asArray()) {
    const bool isName = method.kind() == config::Value::Kind::String;
    const config::Value name = isName               ? method
                               : method.has("name") ? method.get("name")
                                                    : method.get("method");
    names.push_back(name.isNull() ? "" : name.asString());
    const std::string number = std::to_string(names.size() - 1);
    if (chosen == names.back()) chosen = number;
    if (chosen != number) continue;
    if (isName) shorthand = method.asString();
    if (!isName && method.get("fallback").kind() == config::Value::Kind::String)
      fallback = method.get("fallback").asString();
  }
  if (chosen.find_first_not_of("0123456789") != std::string::npos)
    throw UsageError("--set " + path + "=" + value + ": the config has no method \"" + chosen +
                     "\"" + didYouMean(chosen, names) + "; it has " + joined(names, ", "));
  config::Value expanded = root;
  const auto expand = [&](const std::string& place, const std::string& method) {
    expanded =
        config::withSetting(expanded, place, config::JsonText().add("method", method).object());
  };
  if (!shorthand.empty()) expand("methods." + chosen, shorthand);
  if (path.compare(dot, kFallback.size(), kFallback) == 0 &&
      methods::findMethod(methods::registry(), fallback) != nullptr)
    expand("methods." + chosen + ".fallback", fallback);
  return config::withSetting(expanded, "methods." + chosen + path.substr(dot), value);
}

/// The config with the methods that --method names and the config has not, so that --set can change
/// their options.
config::Value withSelected(const config::Value& root, const std::vector<std::string>& selected) {
  const config::Value methods = config::valueOr(root, run::runSchema(), "methods");
  if (root.kind() != config::Value::Kind::Object || methods.kind() != config::Value::Kind::Array)
    return root;
  config::Value all = root;
  std::size_t count = methods.asArray().size();
  if (!root.has("methods")) all = config::withSetting(all, "methods", methods.dump());
  for (const std::string& name : selected) {
    const auto isIt = [&](const config::Value& value) {
      return value.kind() == config::Value::Kind::String && value.asString() == name;
    };
    const bool there = std::ranges::any_of(methods.asArray(), [&](const config::Value& method) {
      return isIt(method) || (method.kind() == config::Value::Kind::Object &&
                              (isIt(method.get("name")) || isIt(method.get("method"))));
    });
    if (there || methods::findMethod(methods::registry(), name) == nullptr) continue;
    all = config::withSetting(all, "methods." + std::to_string(count++),
                              config::JsonText().add("method", name).object(), "--method " + name);
  }
  return all;
}

}  // namespace

std::vector<std::filesystem::path> dataFolders() {
  std::error_code error;
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", error);
  const std::filesystem::path installed =
      (program.parent_path() / "../share/catoptric").lexically_normal();
  std::vector<std::filesystem::path> folders = {""};
  if (std::filesystem::is_directory(installed, error) &&
      !std::filesystem::equivalent(installed, ".", error))
    folders.push_back(installed);
  return folders;
}

std::string listedFile(const std::string& name, const std::vector<std::string>& kinds) {
  namespace fs = std::filesystem;
  std::error_code ignored;
  if (fs::path(name).has_parent_path() || fs::exists(name, ignored)) return name;
  for (const fs::path& folder : dataFolders())
    for (const std::string& kind : kinds)
      for (const char* extension : {"", ".json", ".gltf", ".glb"}) {
        const fs::path file = folder / kind / (name + extension);
        if (!fs::is_regular_file(file, ignored)) continue;
        // Once: studies read their config again for each setting
        if (static std::set<std::string> said; said.insert(name).second)
          log::info(name + ": reads " + file.string());
        return file.string();
      }
  return name;
}

Rows sceneRows(RunOptions& options) {
  return {
      option("--environment", options.environment, "FILE|COLOUR",
             "Replace the scene's environment light: by an image (.exr, .hdr), a colour "
             "(#8090a0), a radiance (0.5,0.5,0.5), or sky",
             {.notEmpty = true}),
      option("--asset-path", options.assetPaths, "FOLDER",
             "Look in this folder for files that are not in the scene's own folder. Repeat the "
             "option for several folders",
             {.oneEach = true}),
      option("--ground", options.ground, "KIND",
             "Put a plane that receives shadows below a glTF file: matte, or mirror, which "
             "reflects half of the light",
             {.notEmpty = true}),
  };
}

Rows runRows(RunOptions& options, CommonOptions& common) {
  return Rows{
             option("input", options.input, "CONFIG|SCENE",
                    "A run config, or a scene (.json, .gltf, .glb) to render with the defaults of "
                    "a config; -: a run config from standard input",
                    {.required = true}),
             option("--frames", options.frames, "LIST",
                    "Frames of the path, such as 1-100x2,120: every second frame from 1 to 100, "
                    "and frame 120 [all]",
                    {.notEmpty = true}),
             option("--camera", options.camera, "CAMERA",
                    "Use this camera instead of the config's path: the name of one of the scene's; "
                    "front or three_quarter, which show the whole scene; turntable:48, which are "
                    "48 frames around it; or EYE/TARGET/FOV in metres and degrees, such as "
                    "2,1,3/0,0.5,0/45",
                    {.notEmpty = true}),
         } +
         sceneRows(options) +
         Rows{
             option("--method", options.methods, "NAME",
                    "Run only these methods, separated by commas: names in the config, or from "
                    "`catoptric list methods` [all of the config]",
                    {.commas = true, .oneEach = true}),
             option("--set", options.settings, "A.B=VALUE",
                    "Change one value of the config (docs/config.md), such as image.width=256 or "
                    "methods.traced.bvh=refit. Repeat the option for several values. A method is "
                    "given by its name, or by its number in the config, from 0. File names are "
                    "relative to the current folder",
                    {.oneEach = true}),
             option("--device", options.device, "DEVICE",
                    "OpenGL device: auto, egl:N, surfaceless, or osmesa; `catoptric doctor` tries "
                    "them all [auto]"),
             option("--threads", options.threads, "N",
                    "Number of threads; 0: one per processor [0]"),
             option("--seed", options.seed, "N", "Seed of all random numbers [1]"),
         } +
         commonRows(common) +
         Rows{
             option("--shader-dir", common.shaderFolder, "DIR",
                    "For developers: read the shaders from this copy of src/ instead of from the "
                    "program"),
         };
}

namespace {

/// The config that a file, a scene or standard input gives, before the command line changes it.
config::Value inputConfig(const RunOptions& options, const std::filesystem::path& file) {
  if (options.input == kStandardInput) {
    config::Value root = config::parseText(standardInput(), "standard input");
    if (run::fileKind(root) == run::FileKind::Scene)
      throw UsageError(
          "standard input: is a scene; only a run config can be read from standard input");
    return root;
  }
  requireInput(file.string());
  if (run::isScene(file)) {
    // Methods that are known; readRunConfig() complains of the others.
    std::vector<std::string> methods;
    for (const std::string& name : options.methods)
      if (methods::findMethod(methods::registry(), name) != nullptr &&
          std::ranges::find(methods, name) == methods.end())
        methods.push_back(name);
    if (methods.empty()) methods.emplace_back(methods::kDefaultMethod);
    return run::configOfScene(file, methods);
  }
  config::Value root = config::parseFile(file);
  if (run::fileKind(root) == run::FileKind::Path)
    throw UsageError(
        file.string() +
        ": is a camera path; give a run config or a scene, and this path by --set path=" +
        file.string());
  return root;
}

void set(config::Value& root, const std::string& name, const std::string& value,
         const std::string& json, const char* option) {
  if (!value.empty()) root = config::withSetting(root, name, json, option + (" " + value));
}

/// Applies the options of sceneRows().
void setSceneOptions(config::Value& root, const RunOptions& options) {
  set(root, "environment", options.environment, config::jsonString(options.environment),
      "--environment");
  if (!options.assetPaths.empty()) root = config::withSetting(root, "asset_paths", "[]");
  for (std::size_t i = 0; i < options.assetPaths.size(); ++i)
    set(root, "asset_paths." + std::to_string(i), options.assetPaths[i],
        config::jsonString(options.assetPaths[i]), "--asset-path");
  set(root, "ground", options.ground, config::jsonString(options.ground), "--ground");
}

}  // namespace

InputConfig readConfig(const RunOptions& options) {
  // What standard input names is relative to the current folder, and its results go to out/stdin.
  const std::filesystem::path file =
      options.input == kStandardInput ? "stdin" : listedFile(options.input, {"configs", "scenes"});
  InputFiles inputs;
  config::Value root = [&] {
    const InputFiles::Recording recording(inputs);
    return inputConfig(options, file);
  }();
  if (!options.settings.empty()) root = withSelected(root, options.methods);
  for (const std::string& setting : options.settings) {
    const std::size_t equals = setting.find('=');
    if (equals == std::string::npos || equals == 0)
      throw UsageError("--set \"" + setting +
                       "\": must be name=value, such as --set image.width=256");
    root = changed(root, setting.substr(0, equals), setting.substr(equals + 1));
  }
  if (!options.camera.empty()) {
    for (const std::string& setting : options.settings)
      if (setting.starts_with("path="))
        throw UsageError("--set " + setting + " and --camera contradict each other; give one");
    root = config::without(root, {"path"});
  }
  set(root, "camera", options.camera, config::jsonString(options.camera), "--camera");
  setSceneOptions(root, options);
  set(root, "frames", options.frames, config::jsonString(options.frames), "--frames");
  set(root, "device", options.device, config::jsonString(options.device), "--device");
  set(root, "threads", options.threads, options.threads, "--threads");
  set(root, "seed", options.seed, options.seed, "--seed");
  run::RunConfig run = run::readRunConfig(root, file, methods::registry(), options.methods);
  run.inputs = std::move(inputs);
  return {std::move(root), std::move(run)};
}

run::RunConfig readRun(const RunOptions& options) {
  run::RunConfig run = readConfig(options).run;
  setThreadCount(run.threads);
  return run;
}

run::RunConfig readScene(const RunOptions& options) {
  config::Value root = run::configOfScene(options.input, {methods::kDefaultMethod});
  setSceneOptions(root, options);
  return run::readRunConfig(root, options.input, methods::registry());
}

std::string portableConfig(const InputConfig& input) {
  config::Value root = config::without(input.root, {"$schema"});
  const auto name = [&](const std::string& member, const std::filesystem::path& file) {
    root = config::withSetting(
        root, member,
        config::jsonString(std::filesystem::absolute(file).lexically_normal().string()));
  };
  name("scene", input.run.scene);
  if (!input.run.path.empty()) name("path", input.run.path);
  if (input.run.environment && input.run.environment->type == scene::EnvironmentType::File)
    name("environment", input.run.environment->file);
  if (!input.run.preview.ocio.empty()) name("preview.ocio", input.run.preview.ocio);
  for (std::size_t i = 0; i < input.run.assetFolders.size(); ++i)
    name("asset_paths." + std::to_string(i), input.run.assetFolders[i]);
  return root.dump(2);
}

}  // namespace catoptric::app
