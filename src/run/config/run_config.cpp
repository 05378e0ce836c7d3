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

std::vector<std::string> methodIds(const std::vector<methods::MethodEntry>& registry) {
  std::vector<std::string> ids;
  for (const methods::MethodEntry& entry : registry) {
    ids.push_back(entry.id);
    for (const methods::MethodAlias& alias : entry.aliases) ids.push_back(alias.id);
  }
  return ids;
}

/// What an alias stands for: the method with its option; an entry has the alias's name.
Value withoutAlias(const Value& value, const methods::MethodEntry& entry, const std::string& id,
                   bool isEntry) {
  const auto alias = std::ranges::find(entry.aliases, id, &methods::MethodAlias::id);
  Value result =
      value.kind() == Value::Kind::Object ? value : config::parseText("{}", value.place().file);
  result = config::withSetting(result, "method", config::jsonString(entry.id));
  if (isEntry && !result.has("name"))
    result = config::withSetting(result, "name", config::jsonString(id));
  return result.has(alias->option) ? result
                                   : config::withSetting(result, alias->option, alias->value);
}

/// What an entry of `methods` can have, and a method of `reflectors` cannot.
constexpr std::array<std::string_view, 3> kOfEntries = {"name", "reflectors", "unsupported"};

bool isFileName(const std::string& name) {
  return !name.empty() && name.front() != '.' &&
         std::all_of(name.begin(), name.end(), [](unsigned char c) {
           return std::isalnum(c) != 0 || c == '_' || c == '-' || c == '.';
         });
}

std::optional<MethodConfig> readMethod(const Value& value,
                                       const std::vector<methods::MethodEntry>& registry,
                                       Errors& errors, bool isEntry);

/// The member `reflectors` of an entry: {"NAME": method, ...}.
std::vector<ReflectorRule> readReflectors(const Value& value,
                                          const std::vector<methods::MethodEntry>& registry,
                                          Errors& errors) {
  std::vector<ReflectorRule> rules;
  for (const std::string& pattern : value.isNull() ? std::vector<std::string>{} : value.keys()) {
    const Value member = value.get(pattern);
    const std::size_t star = pattern.find('*');
    if (pattern.empty() || (star != std::string::npos && star + 1 != pattern.size())) {
      errors.add(member, config::jsonString(pattern) +
                             ": allowed are an object's name, and the beginning of names with * "
                             "at its end");
      continue;
    }
    const auto* const wrong = std::ranges::find_if(kOfEntries, [&](std::string_view name) {
      return member.kind() == Value::Kind::Object && member.has(std::string(name));
    });
    if (wrong != kOfEntries.end()) {
      errors.add(member, config::jsonString(*wrong) +
                             " is for entries of methods: a method of some reflectors has "
                             "\"method\" and the method's own options alone");
      continue;
    }
    const std::optional<MethodConfig> method = readMethod(member, registry, errors, false);
    if (method) rules.push_back({pattern, method->id, method->options, method->effective, member});
  }
  return rules;
}

/// A method of `methods` or `reflectors`: "traced" or {"method": "traced", ...}. Nothing when it
/// has errors.
std::optional<MethodConfig> readMethod(const Value& value,
                                       const std::vector<methods::MethodEntry>& registry,
                                       Errors& errors, bool isEntry) {
  const std::vector<std::string> ids = methodIds(registry);
  const bool isName = value.kind() == Value::Kind::String;
  if (!isName && value.kind() != Value::Kind::Object) {
    errors.add(value, value.dump() + " is neither a method's name nor an object with \"method\"");
    return {};
  }
  const Value idValue = isName ? value : value.get("method");
  if (idValue.isNull()) {
    errors.add(value, "\"method\" is missing; expected one of: " + joined(ids, ", "));
    return {};
  }
  if (idValue.kind() != Value::Kind::String) {
    errors.add(idValue, idValue.dump() + " is not a method's name; allowed: " + joined(ids, ", "));
    return {};
  }
  const std::string& id = idValue.asString();
  const methods::MethodEntry* entry = methods::findMethod(registry, id);
  if (entry == nullptr) {
    errors.add(idValue, idValue.dump() + " is not a method" + didYouMean(id, ids) +
                            "; allowed: " + joined(ids, ", "));
    return {};
  }
  if (entry->id != id)
    return readMethod(withoutAlias(value, *entry, id, isEntry), registry, errors, isEntry);

  MethodConfig method;
  method.id = id;
  method.name = id;
  if (isName) {
    method.options = config::parseText("{}", value.place().file);
  } else {
    Schema schema = methodSchema(*entry);
    if (!isEntry)
      std::erase_if(schema.fields, [](const Field& field) {
        return std::ranges::find(kOfEntries, field.name) != kOfEntries.end();
      });
    const std::vector<std::string> lines = config::check(value, schema);
    errors.add(lines);
    if (!lines.empty()) return {};
    if (value.has("name")) method.name = value.get("name").asString();
    method.reflectors = readReflectors(value.get("reflectors"), registry, errors);
    if (value.has("unsupported")) method.unsupported = value.get("unsupported").asString();
    method.options =
        config::without(value, {"method", "name", "comment", "reflectors", "unsupported"});
  }
  if (!isFileName(method.name)) {
    errors.add(value.get("name"), config::jsonString(method.name) +
                                      " cannot name a folder; allowed: letters, digits, _ - .");
    return {};
  }
  if (isRunFileName(method.name)) {
    errors.add(value.get("name"), config::jsonString(method.name) +
                                      " is the name of a run's own file; choose another");
    return {};
  }
  method.effective = config::withDefaults(method.options, entry->options);
  return method;
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

std::vector<std::string> fallbackMethods() {
  std::vector<std::string> names;
  for (const methods::MethodEntry& entry : methods::registry())
    if (entry.fallbackOptions != nullptr) names.push_back(entry.id);
  return names;
}

Schema methodSchema(const methods::MethodEntry& entry) {
  Schema schema{entry.id, entry.summary, {}};
  std::vector<std::string> ids = {entry.id};
  for (const methods::MethodAlias& alias : entry.aliases) ids.push_back(alias.id);
  schema.fields.push_back(
      fields::required(fields::choice("method", "The method.", "", std::move(ids))));
  schema.fields.push_back(
      fields::text("name", "Name of its folder and of its table rows [the method's name].",
                   config::jsonString(entry.id)));
  schema.fields.push_back(fields::any("comment", "Any text; ignored."));
  static const Schema reflectors{.name = "reflectors", .help = "", .fields = {}, .open = true};
  schema.fields.push_back(fields::object(
      "reflectors",
      "Other methods for some reflective objects: {\"NAME\": \"traced\", \"lamp*\": "
      "{\"method\": \"traced\", \"rays\": 16}}. * at the end of a NAME stands for any text; "
      "`planar`, `curved` (mirrors) and `glossy` stand for all reflectors of a kind. A full name "
      "wins over a pattern, a longer pattern over a shorter one, a kind over * alone.",
      &reflectors));
  if (entry.refusesReflectors) {
    std::vector<std::string> allowed = fallbackMethods();
    allowed.insert(allowed.begin(), "error");
    schema.fields.push_back(
        fields::choice("unsupported",
                       "What happens to reflectors that the method cannot render. error: the run "
                       "ends; environment_map, traced: that method renders them (counter "
                       "unsupported_reflector).",
                       "\"error\"", allowed));
  }
  schema.fields.insert(schema.fields.end(), entry.options.fields.begin(),
                       entry.options.fields.end());
  return schema;
}

void MethodConfig::addSettings(config::JsonText& text) const {
  text.add("method", id).raw("options", effective);
  if (!reflectors.empty()) {
    config::JsonText rules;
    for (const ReflectorRule& rule : reflectors)
      rules.raw(rule.pattern,
                config::JsonText().add("method", rule.id).raw("options", rule.effective).object());
    text.raw("reflectors", rules.object());
  }
  if (unsupported != "error") text.add("unsupported", unsupported);
}

namespace {

/// All entries of `methods`, each with a schema of its own; a name twice is an error.
std::vector<MethodConfig> readMethods(const Value& root,
                                      const std::vector<methods::MethodEntry>& registry,
                                      Errors& errors) {
  std::vector<MethodConfig> result;
  const Value methods = config::valueOr(root, runSchema(), "methods");
  if (methods.kind() != Value::Kind::Array) return result;
  std::set<std::string> names;
  for (const Value& entry : methods.asArray()) {
    std::optional<MethodConfig> method = readMethod(entry, registry, errors, true);
    if (!method) continue;
    if (!names.insert(method->name).second)
      errors.add(entry, "two methods are called \"" + method->name +
                            "\"; give one of them another \"name\"");
    result.push_back(std::move(*method));
  }
  return result;
}

/// --method: the config's entries of that name, else all of that method, else its defaults.
std::vector<MethodConfig> selectMethods(const std::vector<MethodConfig>& all,
                                        const std::vector<std::string>& selected,
                                        const std::vector<methods::MethodEntry>& registry,
                                        Errors& errors) {
  std::vector<MethodConfig> chosen;
  for (const std::string& name : selected) {
    const std::size_t before = chosen.size();
    for (const MethodConfig& method : all)
      if (method.name == name) chosen.push_back(method);
    if (chosen.size() == before)
      for (const MethodConfig& method : all)
        if (method.id == name) chosen.push_back(method);
    if (chosen.size() > before) continue;
    std::vector<std::string> allowed = methodIds(registry);
    for (const MethodConfig& method : all)
      if (methods::findMethod(registry, method.name) == nullptr) allowed.push_back(method.name);
    if (methods::findMethod(registry, name) == nullptr)
      throw UsageError("--method: \"" + name + "\" is not a method" + didYouMean(name, allowed) +
                       "; allowed: " + joined(allowed, ", "));
    chosen.push_back(*readMethod(config::parseText(config::jsonString(name), "--method"), registry,
                                 errors, true));
  }
  for (std::size_t i = 0; i < chosen.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      if (chosen[i].name == chosen[j].name)
        throw UsageError("--method: \"" + chosen[i].name + "\" is named twice");
  return chosen;
}

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
  const std::vector<MethodConfig> configured = readMethods(root, registry, errors);
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

std::string entryName(const Value& entry) {
  if (entry.kind() == Value::Kind::String) return entry.asString();
  const Value name = entry.get(entry.has("name") ? "name" : "method");
  return name.isNull() ? "" : name.asString();
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
