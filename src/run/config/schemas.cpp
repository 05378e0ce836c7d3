#include "run/config/schemas.h"

#include "config/json.h"
#include "config/json_text.h"
#include "core/error.h"
#include "core/text.h"
#include "run/config/run_config.h"
#include "scene/description/description.h"
#include "scene/paths/path.h"

namespace catoptric::run {
namespace {

/// docs/config.md begins with this.
constexpr const char* kRunPreface = R"(# Run configs

A run config is a JSON file that says which frames of which scene are rendered, how, and by which
methods: `catoptric render configs/demo.json`. A bare scene (`catoptric render room.glb`) is rendered
with the defaults below. Any value can be replaced on the command line: `--set image.width=256`,
`--set methods.0.bvh=refit`. Paths are relative to the config. Unknown names, values out of range
and duplicate names are errors that name file, line and place; all errors of a file (the first 20) are shown at once.
A file with one method puts its frames into `--out` itself, a file with several a folder for each.

This page and configs/schema/ are made from the program's own tables, and a test holds them to it:

    catoptric list --schema run --markdown > docs/config.md
    for s in run scene path; do catoptric list --schema $s > configs/schema/$s.schema.json; done

Editors that know JSON Schema check and complete a config that begins with
`"$schema": "schema/run.schema.json"`. Scenes and paths are described in scenes.md.

)";

const config::Schema& schemaOf(const std::string& name) {
  if (name == "run") return runSchema();
  if (name == "scene") return scene::sceneSchema();
  if (name == "path") return scene::pathSchema();
  throw UsageError("--schema: \"" + name + "\" is not known" + didYouMean(name, schemaNames()) +
                   "; allowed: " + joined(schemaNames(), ", "));
}

}  // namespace

const std::vector<std::string>& schemaNames() {
  static const std::vector<std::string> names = {"run", "scene", "path"};
  return names;
}

std::string schemaJson(const std::string& name, const std::vector<methods::MethodEntry>& registry) {
  std::string text = config::jsonSchema(schemaOf(name));
  if (name != "run") return text;
  // A member of `methods` is a method's name, or an object with that method's options.
  std::vector<std::string> ids;
  std::vector<std::string> forms;
  for (const methods::MethodEntry& entry : registry) {
    ids.push_back(config::jsonString(entry.id));
    config::Value form =
        config::parseText(config::jsonSchema(methodSchema(entry)), "schema of " + entry.id);
    forms.push_back(form.dump());
  }
  forms.insert(forms.begin(), "{\"enum\":[" + joined(ids, ",") + "]}");
  const config::Value schema =
      config::withSetting(config::parseText(text, "schema"), "properties.methods.items",
                          "{\"anyOf\":[" + joined(forms, ",") + "]}");
  return schema.dump(2) + "\n";
}

std::string schemaMarkdown(const std::string& name,
                           const std::vector<methods::MethodEntry>& registry) {
  std::string text = config::markdownTable(schemaOf(name));
  if (name != "run") return text;
  text = std::string(kRunPreface) + text;
  for (const methods::MethodEntry& entry : registry)
    text += config::markdownTable(methodSchema(entry));
  return text;
}

}  // namespace catoptric::run
