#include "nightly/suite.h"

#include <algorithm>

namespace catoptric::nightly {
namespace {

using config::Field, config::FieldType, config::Schema, config::Value;

const Schema& anySchema() {
  static const Schema schema{.name = "any", .help = "", .fields = {}, .open = true};
  return schema;
}

const Schema& sceneSchema() {
  static const Schema schema{
      .name = "scene",
      .help = "A scene of a suite, by one or several methods.",
      .fields = {{.name = "config",
                  .type = FieldType::String,
                  .help = "A run config, relative to the suite.",
                  .required = true},
                 {.name = "settings",
                  .type = FieldType::Object,
                  .help = "Values of the config, by their names as for --set.",
                  .object = &anySchema()},
                 {.name = "methods",
                  .type = FieldType::Array,
                  .help = "Names of the config's methods, or of others; without it, all.",
                  .items = FieldType::String},
                 {.name = "frames",
                  .type = FieldType::Object,
                  .help = "Frames by effort, as smoke and full; others leave the scene out.",
                  .required = true,
                  .object = &anySchema()},
                 {.name = "against",
                  .type = FieldType::String,
                  .help = "The method whose frames are the truth."},
                 {.name = "tags",
                  .type = FieldType::Array,
                  .help = "Words for --only.",
                  .items = FieldType::String}}};
  return schema;
}

const Schema& suiteSchema() {
  static const Schema schema{
      .name = "suite",
      .help = "A suite of nightly cases.",
      .fields = {{.name = "comment", .type = FieldType::Any, .help = "Not read."},
                 {.name = "title", .type = FieldType::String, .help = "Title.", .required = true},
                 {.name = "gates",
                  .type = FieldType::Object,
                  .help = "What a night may differ by.",
                  .object = &gatesSchema()},
                 {.name = "scenes",
                  .type = FieldType::Object,
                  .help = "Scenes by name.",
                  .required = true,
                  .object = &anySchema()}}};
  return schema;
}

std::vector<std::string> stringsOf(const Value& array) {
  std::vector<std::string> texts;
  if (!array.isNull())
    for (const Value& text : array.asArray()) texts.push_back(text.asString());
  return texts;
}

/// Names are parts of files, addresses on the page and shells' words.
bool isName(const std::string& name) {
  return !name.empty() && name.find_first_not_of(
                              "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-") ==
                              std::string::npos;
}
constexpr const char* kNameRule = "must have letters a-z, A-Z, 0-9, _ and - only";

NightScene readScene(const std::string& name, const Value& value,
                     const std::filesystem::path& folder) {
  config::require(value, sceneSchema());
  if (!isName(name)) value.fail("the scene's name \"" + name + "\" " + kNameRule);
  NightScene scene;
  scene.name = name;
  scene.config = (folder / value.get("config").asString()).lexically_normal();
  if (value.has("settings"))
    for (const std::string& key : value.get("settings").keys()) {
      const Value setting = value.get("settings").get(key);
      const bool isFile = key == "scene" || key == "path";  // relative to the suite
      scene.settings.emplace_back(key,
                                  isFile ? (folder / setting.asString()).lexically_normal().string()
                                  : setting.kind() == Value::Kind::String ? setting.asString()
                                                                          : setting.dump());
    }
  scene.methods = stringsOf(value.get("methods"));
  for (auto method = scene.methods.begin(); method != scene.methods.end(); ++method)
    if (std::find(scene.methods.begin(), method, *method) != method)
      value.fail("the method \"" + *method + "\" is named twice");
  for (const std::string& effort : value.get("frames").keys())
    scene.frames[effort] = value.get("frames").get(effort).asString();
  if (value.has("against")) scene.against = value.get("against").asString();
  scene.tags = stringsOf(value.get("tags"));
  return scene;
}

}  // namespace

NightSuite readNightSuite(const std::filesystem::path& file) {
  const Value root = config::parseFile(file);
  config::require(root, suiteSchema());
  NightSuite suite;
  suite.name = file.stem().string();
  if (suite.name.ends_with(".suite")) suite.name.resize(suite.name.size() - 6);
  if (!isName(suite.name)) root.fail("the suite's file name \"" + suite.name + "\" " + kNameRule);
  suite.title = root.get("title").asString();
  suite.gates = readGates(root.get("gates"));
  for (const std::string& name : root.get("scenes").keys())
    suite.scenes.push_back(readScene(name, root.get("scenes").get(name), file.parent_path()));
  return suite;
}

}  // namespace catoptric::nightly
