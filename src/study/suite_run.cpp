#include "study/suite_run.h"

#include "config/fields.h"

namespace catoptric::study {

using config::FieldType, config::Schema, config::Value;
namespace fields = config::fields;

Schema runSchemaOfSuite(std::vector<config::Field> more) {
  Schema schema{
      .name = "run",
      .help = "A run of a suite.",
      .fields = {fields::required(fields::text("config", "A run config, relative to the suite.")),
                 fields::object("settings", "Values of the config, by their names as for --set."),
                 fields::arrayOf("methods", "Names of the config's methods, or of others [all].",
                                 FieldType::String),
                 fields::text("against", "The method whose frames are the truth.")}};
  schema.fields.insert(schema.fields.end(), more.begin(), more.end());
  return schema;
}

std::vector<std::string> stringsOf(const Value& array) {
  std::vector<std::string> texts;
  if (!array.isNull())
    for (const Value& text : array.asArray()) texts.push_back(text.asString());
  return texts;
}

Settings readSettings(const Value& value, const std::filesystem::path& folder) {
  Settings settings;
  for (const std::string& key : value.keys()) {
    const Value setting = value.get(key);
    const bool isFile = key == "scene" || key == "path";
    settings.emplace_back(key, isFile ? (folder / setting.asString()).lexically_normal().string()
                               : setting.kind() == Value::Kind::String ? setting.asString()
                                                                       : setting.dump());
  }
  return settings;
}

StatedRun readRunOfSuite(const std::string& name, const Value& value,
                         const std::filesystem::path& folder) {
  StatedRun run;
  run.name = name;
  run.config = (folder / value.get("config").asString()).lexically_normal();
  if (value.has("settings")) run.settings = readSettings(value.get("settings"), folder);
  run.methods = stringsOf(value.get("methods"));
  if (value.has("frames"))
    for (const std::string& effort : value.get("frames").keys())
      run.frames[effort] = value.get("frames").get(effort).asString();
  if (value.has("against")) run.against = value.get("against").asString();
  return run;
}

std::string jsonSchemaOfSuite(const config::Schema& suite, const std::string& runs,
                              const config::Schema& run) {
  return config::withSetting(config::parseText(config::jsonSchema(suite), "schema"),
                             "properties." + runs + ".additionalProperties",
                             config::jsonSchema(run))
             .dump(2) +
         "\n";
}

}  // namespace catoptric::study
