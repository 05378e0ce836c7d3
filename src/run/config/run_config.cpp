#include "run/config/run_config.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <optional>
#include <set>

#include "config/fields.h"
#include "config/json_text.h"
#include "config/options.h"
#include "core/error.h"
#include "core/text.h"
#include "run/folder/run_folder.h"
#include "run/stage/layers.h"
#include "scene/environment.h"
#include "scene/paths/path.h"

namespace catoptric::run {
namespace {

using config::AllowedItems, config::Errors, config::Field, config::FieldType, config::Option,
    config::OptionTable, config::Schema, config::Value;
namespace fields = config::fields;
using config::atLeast, config::field, config::group, config::in, config::range;

constexpr auto kCompressions =
    config::names<image::Compression>({{"none", image::Compression::None},
                                       {"zip", image::Compression::Zip},
                                       {"piz", image::Compression::Piz}});

/// Those of every frame but the masks, then those of the methods.
AllowedItems layerNames() {
  std::vector<std::string> names;
  for (const methods::SampleLayerInfo& layer : frameLayers())
    if (!layer.name.starts_with("mask.")) names.push_back(layer.name);
  for (const methods::MethodEntry& entry : methods::registry())
    for (const methods::SampleLayerInfo& layer : entry.sampleLayers)
      if (std::find(names.begin(), names.end(), layer.name) == names.end())
        names.push_back(layer.name);
  return {names};
}

const OptionTable<RunConfig>& imageTable() {
  using methods::RunSettings;
  static const OptionTable<RunConfig> table(
      "image", "",
      {field(in(&RunConfig::image, &RunSettings::width), "width", range(1, 16384),
             "Width, pixels."),
       field(in(&RunConfig::image, &RunSettings::height), "height", range(1, 16384),
             "Height, pixels."),
       field(in(&RunConfig::image, &RunSettings::samples), "samples", range(1, 8),
             "Samples per pixel along each axis."),
       field(in(&RunConfig::image, &RunSettings::layers), "layers", layerNames(),
             "Layers besides R G B A (docs/outputs.md)."),
       field(in(&RunConfig::image, &RunSettings::masks), "masks",
             "Layers mask.*: how much of a pixel is glossy, re-traced, disoccluded, ... "
             "(docs/outputs.md)."),
       field(in(&RunConfig::image, &RunSettings::countDisocclusions), "count_disocclusions",
             "second_order, perturbation, screen_space: also trace each reflection, and count "
             "disocclusions (mask.disoccluded); slow."),
       field(in(&RunConfig::image, &RunSettings::fresnelSchlick), "fresnel",
             "Weight reflections by Schlick's Fresnel term with F0 = s, instead of s."),
       field(&RunConfig::halfBeauty, "half",
             "Write R G B A as 16-bit floats; other layers always have 32 bits."),
       field(&RunConfig::compression, "compression", kCompressions,
             "Lossless compression of the EXR files.")});
  return table;
}

/// A file named in the config: relative to the config, or to the working folder for a --set.
std::filesystem::path resolved(const Value& value, const std::filesystem::path& configFile) {
  const std::filesystem::path named = value.asString();
  const bool fromFile = value.place().line > 0;
  return (named.is_absolute() || !fromFile ? named : configFile.parent_path() / named)
      .lexically_normal();
}

/// A member that is read apart, because it needs more than its own value.
Option<RunConfig> readApart(Field description) {
  return {std::move(description), [](RunConfig&, const Value&) {}};
}

const OptionTable<RunConfig>& previewTable() {
  static const OptionTable<RunConfig> table(
      "preview", "8-bit PNG pictures of the frames.",
      {field(in(&RunConfig::preview, &PreviewConfig::enabled), "enabled",
             "Write previews/frame.0001.png, ..."),
       field(in(&RunConfig::preview, &PreviewConfig::exposureStops), "exposure", range(-20, 20),
             "Exposure before the display transform, stops."),
       field(in(&RunConfig::preview, &PreviewConfig::view), "view",
             "View of `ocio`; built in: sRGB, Linear, Neutral (sRGB, but above 0.8 compressed) "
             "[Neutral, or the first]."),
       readApart(fields::text("ocio", "OpenColorIO config [built in]."))});
  return table;
}

const OptionTable<RunConfig>& errorsTable() {
  static const OptionTable<RunConfig> table(
      "errors", "Table of errors after the run.",
      {field(&RunConfig::errorsAgainst, "against",
             "Names of methods with which the other methods are compared.")});
  return table;
}

const OptionTable<RunConfig>& sweepTable() {
  static const OptionTable<RunConfig> table(
      "sweep", "What `catoptric sweep` measures; options on the command line replace it.",
      {field(in(&RunConfig::sweep, &SweepConfig::vary), "vary",
             "Options and values, as for --vary: \"methods.traced.rays=1,4,16\"."),
       field(in(&RunConfig::sweep, &SweepConfig::link), "link",
             "Options that change together, as for --link: \"image.width,image.height\"."),
       field(in(&RunConfig::sweep, &SweepConfig::where), "where",
             "Conditions that combinations must satisfy: \"rays<=16\"."),
       field(in(&RunConfig::sweep, &SweepConfig::metrics), "metric",
             "Error measures; the first is plotted against time."),
       field(in(&RunConfig::sweep, &SweepConfig::against), "against",
             "Reference of the errors: a method or a folder of frames [the first of "
             "errors.against]."),
       field(in(&RunConfig::sweep, &SweepConfig::ratioTo), "ratio_to",
             "Baseline of time ratios: the first combination of this method [the first of all "
             "combinations]."),
       field(in(&RunConfig::sweep, &SweepConfig::repeats), "repeats", range(0, 1000),
             "Timed rounds; 0: errors only.")});
  return table;
}

const OptionTable<RunConfig>& runTable() {
  using methods::RunSettings;
  static const OptionTable<RunConfig> table(
      "run", "",
      {readApart(fields::text("$schema", "For editors; ignored.")),
       readApart(fields::any("comment", "Any text; ignored.")),
       readApart(fields::required(
           fields::text("scene", "A .gltf or .glb file, or a scene description (.json)."))),
       readApart(fields::text("path", "Camera path (.json) [`camera`].")),
       field(
           &RunConfig::camera, "camera",
           "In place of a path: a camera's name, `front`, `three_quarter`, `turntable:48` (frames) "
           "or EYE/TARGET/FOV, as 2,1,3/0,0.5,0/45 [the first camera, or front]."),
       readApart(fields::text(
           "environment",
           "Replaces the scene's environment light: an image (latitude-longitude, .exr or .hdr), a "
           "colour (\"#8090a0\"), a radiance (\"0.5,0.5,0.5\") or \"sky\".")),
       field(
           &RunConfig::ground, "ground",
           config::names<scene::Ground>({{"none", scene::Ground::None},
                                         {"matte", scene::Ground::Matte},
                                         {"mirror", scene::Ground::Mirror}}),
           "A plane below a glTF file, which receives shadows. mirror: it also reflects (s 0.5)."),
       field(&RunConfig::showMissingTextures, "missing_textures",
             config::names<bool>({{"error", false}, {"show", true}}),
             "Missing images of glTF files; show: a checkerboard."),
       readApart({.name = "asset_paths",
                  .type = FieldType::Array,
                  .help = "Folders in which the scene's files are also looked for.",
                  .defaultText = "[]"}),
       field(&RunConfig::frames, "frames", "Frames of the path [all]."),
       group("image", imageTable(), "Size, samples, layers."),
       readApart({.name = "methods",
                  .type = FieldType::Array,
                  .help = "Names of methods, or objects with \"method\" and the method's options.",
                  .defaultText = "[" + config::jsonString(methods::kDefaultMethod) + "]",
                  .minimum = 1}),
       group("errors", errorsTable(), "Table of errors."),
       group("preview", previewTable(), "8-bit previews."),
       group("sweep", sweepTable(), "What `catoptric sweep` measures."),
       field(in(&RunConfig::image, &RunSettings::seed), "seed", atLeast(0),
             "Seed of all random numbers."),
       field(&RunConfig::device, "device", "OpenGL device: auto, egl:N, surfaceless or osmesa."),
       field(&RunConfig::threads, "threads", range(0, 1024),
             "Number of threads; 0: one per processor. It does not change pixels.")});
  return table;
}

}  // namespace

const Schema& runSchema() {
  return runTable().schema();
}

namespace {

/// The files that the config names.
void readFiles(RunConfig& run, const Value& root, const std::filesystem::path& file,
               Errors& errors) {
  run.name = file.stem().string();
  run.file = file;
  run.scene = resolved(root.get("scene"), file);
  run.sceneReference = root.get("scene").place().text();
  if (root.has("path")) {
    run.path = resolved(root.get("path"), file);
    run.pathReference = root.get("path").place().text();
  }
  const Value preview = root.get("preview");
  if (!preview.isNull() && preview.has("ocio")) {
    run.preview.ocio = resolved(preview.get("ocio"), file);
    run.preview.ocioReference = preview.get("ocio").place().text();
  }
  if (root.has("camera")) run.cameraReference = root.get("camera").place().text();
  if (root.has("path") && root.has("camera"))
    errors.add(root.get("camera"), "has no effect beside \"path\"; remove one");
  if (root.has("environment"))
    errors.collect([&] {
      const Value environment = root.get("environment");
      run.environment = scene::namedEnvironment(environment, resolved(environment, file));
    });
}

/// The folders of `asset_paths`, which must exist.
void readAssetFolders(RunConfig& run, const Value& root, const std::filesystem::path& file,
                      Errors& errors) {
  for (const Value& folder : config::valueOr(root, runSchema(), "asset_paths").asArray()) {
    errors.collect([&] {
      run.assetFolders.push_back(resolved(folder, file));
      std::error_code ignored;
      if (!std::filesystem::is_directory(run.assetFolders.back(), ignored))
        folder.fail("there is no folder " + run.assetFolders.back().string());
    });
  }
}

/// Keeps those of `errors.against` that are run; those of other methods of the config
/// (`configured`) are dropped.
void keepErrorsAgainst(RunConfig& run, const Value& root,
                       const std::vector<MethodConfig>& configured, Errors& errors) {
  std::vector<std::string> runNames;
  for (const MethodConfig& method : run.methods) runNames.push_back(method.name);
  run.errorsAgainst.clear();
  for (const Value& against :
       config::valueOr(root.get("errors"), errorsTable().schema(), "against").asArray()) {
    const std::string& name = against.asString();
    if (std::find(runNames.begin(), runNames.end(), name) != runNames.end()) {
      run.errorsAgainst.push_back(name);
    } else if (std::any_of(configured.begin(), configured.end(),
                           [&](const MethodConfig& method) { return method.name == name; })) {
      run.errorsDropped.push_back(name);
    } else {
      errors.add(against, config::jsonString(name) + " is not one of this run's methods" +
                              didYouMean(name, runNames) + "; allowed: " + joined(runNames, ", "));
    }
  }
}

std::string effectiveText(const RunConfig& run, const Value& root) {
  std::vector<std::string> methodTexts;
  for (const MethodConfig& method : run.methods) {
    config::JsonText text;
    text.add("name", method.name);
    method.addSettings(text);
    methodTexts.push_back(text.object());
  }
  config::JsonText text;
  if (!run.camera.empty()) text.add("camera", run.camera);
  if (run.showMissingTextures) text.add("missing_textures", "show");
  std::vector<std::string> folders;
  for (const std::filesystem::path& folder : run.assetFolders)
    folders.push_back(folder.generic_string());
  if (!folders.empty()) text.add("asset_paths", folders);
  return text.add("scene", run.scene.generic_string())
      .add("path", run.path.generic_string())
      .add("environment", root.has("environment") ? root.get("environment").asString() : "")
      .add("ground", root.has("ground") ? root.get("ground").asString() : "")
      .add("frames", run.frames)
      .raw("image", config::withDefaults(root.get("image"), imageTable().schema()))
      .raw("methods", "[" + joined(methodTexts, ",") + "]")
      .raw("errors", config::withDefaults(root.get("errors"), errorsTable().schema()))
      .raw("preview", config::withDefaults(root.get("preview"), previewTable().schema()))
      .add("seed", run.image.seed)
      .add("device", run.device)
      .add("threads", run.threads)
      .object();
}

}  // namespace

RunConfig readRunConfig(const Value& root, const std::filesystem::path& file,
                        const std::vector<methods::MethodEntry>& registry,
                        const std::vector<std::string>& selected) {
  Errors errors;
  errors.add(config::check(root, runSchema()));
  if (root.kind() != Value::Kind::Object) errors.throwIfAny();
  const std::vector<MethodConfig> configured =
      readMethods(config::valueOr(root, runSchema(), "methods"), registry, errors);
  errors.throwIfAny();

  RunConfig run;
  runTable().read(run, root);
  readFiles(run, root, file, errors);
  readAssetFolders(run, root, file, errors);
  run.methods =
      selected.empty() ? configured : selectMethods(configured, selected, registry, errors);
  keepErrorsAgainst(run, root, configured, errors);
  errors.throwIfAny();
  run.effective = effectiveText(run, root);
  return run;
}

std::string RunConfig::pixelSettings(const MethodConfig& method) const {
  const Value all = config::parseText(effective, "effective config");
  config::JsonText text;
  method.addSettings(text);
  if (preview.enabled && !preview.ocio.empty())
    text.add("view", image::viewFingerprint(preview.shown()));
  return text.raw("image", all.get("image").dump())
      .raw("preview", all.get("preview").dump())
      .add("seed", image.seed)
      .add("device", device)
      .object();
}

Value configOfScene(const std::filesystem::path& scene, const std::vector<std::string>& methods) {
  std::vector<std::string> entries;
  for (const std::string& method : methods)
    entries.push_back(config::JsonText().add("method", method).object());
  return config::withSetting(config::withSetting(config::parseText("{}", scene.string()), "scene",
                                                 config::jsonString(scene.string())),
                             "methods", "[" + joined(entries, ",") + "]");
}

FileKind fileKind(const Value& root) {
  if (root.kind() != Value::Kind::Object) return FileKind::Unknown;
  if (root.has("scene")) return FileKind::RunConfig;
  if (root.has("objects")) return FileKind::Scene;
  const std::vector<config::Field>& fields = scene::pathSchema().fields;
  const auto ofPath = [&](const std::string& key) {
    return std::any_of(fields.begin(), fields.end(),
                       [&](const config::Field& field) { return field.name == key; });
  };
  const std::vector<std::string> keys = root.keys();
  const bool isPath = root.has("frames") && std::all_of(keys.begin(), keys.end(), ofPath) &&
                      std::any_of(keys.begin(), keys.end(), [](const std::string& key) {
                        return runSchema().fields.end() ==
                               std::find_if(runSchema().fields.begin(), runSchema().fields.end(),
                                            [&](const config::Field& f) { return f.name == key; });
                      });
  return isPath ? FileKind::Path : FileKind::Unknown;
}

bool isScene(const std::filesystem::path& file) {
  std::string extension = file.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (extension == ".gltf" || extension == ".glb") return true;
  return fileKind(config::parseFile(file)) == FileKind::Scene;
}

}  // namespace catoptric::run
