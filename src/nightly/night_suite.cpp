#include "nightly/night_suite.h"

#include <algorithm>

namespace catoptric::nightly {
namespace {

using config::Field, config::FieldType, config::Schema, config::Value;

const Schema& sceneSchema() {
  static const Schema schema = study::runSchemaOfSuite(
      {{.name = "frames",
        .type = FieldType::Object,
        .help = "Frames by effort, as smoke and full; others leave the scene out.",
        .required = true,
        .object = &study::openSchema()},
       {.name = "tags",
        .type = FieldType::Array,
        .help = "Words for --only.",
        .items = FieldType::String}});
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
                  .object = &study::openSchema()}}};
  return schema;
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
  NightScene scene{study::readRunOfSuite(name, value, folder), {}};
  for (auto method = scene.methods.begin(); method != scene.methods.end(); ++method)
    if (std::find(scene.methods.begin(), method, *method) != method)
      value.fail("the method \"" + *method + "\" is named twice");
  scene.tags = study::stringsOf(value.get("tags"));
  return scene;
}

}  // namespace

NightSuite readNightSuite(const std::filesystem::path& file) {
  const Value root = config::parseFile(file);
  config::require(root, suiteSchema());
  NightSuite suite;
  suite.file = file.string();
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
