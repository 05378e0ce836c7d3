#include "nightly/night_suite.h"

#include <algorithm>

#include "config/fields.h"

namespace catoptric::nightly {
namespace {

using config::FieldType, config::Schema, config::Value;
namespace fields = config::fields;

const Schema& sceneSchema() {
  static const Schema schema = study::runSchemaOfSuite(
      {fields::required(fields::object(
           "frames", "Frames by effort, as smoke and full; others leave the scene out.")),
       fields::arrayOf("tags", "Words for --only.", FieldType::String)});
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

const Schema& suiteSchema() {
  static const Schema schema{
      .name = "suite",
      .help = "A suite of nightly cases.",
      .fields = {fields::any("$schema", "For editors; not read."),
                 fields::any("comment", "Not read."),
                 fields::required(fields::text("title", "Title.")),
                 fields::object("gates", "What a night may differ by.", &gatesSchema()),
                 fields::required(fields::object("scenes", "Scenes by name."))}};
  return schema;
}

}  // namespace

std::string suiteJsonSchema() {
  return study::jsonSchemaOfSuite(suiteSchema(), "scenes", sceneSchema());
}

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
