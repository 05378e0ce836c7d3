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

A run config is a JSON file. It says which frames of which scene are rendered, how, and by which
methods. `catoptric render configs/demo.json` renders one. A scene can be rendered without a config,
too (`catoptric render room.glb`): everything then has the defaults of the tables below.

Any value can be replaced on the command line: `--set image.width=256`, or, for an option of a method,
`--set methods.traced.bvh=refit` with the method's name (or its number) in the config. A list is
written as in JSON: `--set 'image.layers=["Z"]'`. File names in a config are relative to the config;
those of `--set` and `--environment` are relative to the current folder.

A name that does not exist, a value out of range and a name that stands twice are errors. The message
gives the file, the line and the place in it, and all errors of a file (up to 20) are shown at once.

A config with one method writes its frames into the folder `--out`. A config with several methods
writes a folder for each of them there.

## Where this page comes from

The tables on this page and the files in configs/schema/ are written by the program itself, and a test
compares them:

    catoptric list --schema run --markdown > docs/config.md
    for s in run scene path; do catoptric list --schema $s > configs/schema/$s.schema.json; done

An editor that knows JSON Schema checks and completes a config that begins with
`"$schema": "schema/run.schema.json"`. Scenes and camera paths take such a line, too; scenes.md
describes them.

## Tables

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
