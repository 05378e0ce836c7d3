#include "run/config/schemas.h"

#include <algorithm>

#include "config/json.h"
#include "config/json_text.h"
#include "config/pages.h"
#include "core/error.h"
#include "core/text.h"
#include "run/config/run_config.h"
#include "scene/description/description.h"
#include "scene/paths/path.h"

namespace catoptric::run {
namespace {

/// docs/config.md begins with this.
constexpr const char* kRunPreface = R"(# Run configs

A run config is a JSON file. It names a scene, a camera path, frames and methods:

```json
{"scene": "../scenes/teapots.json", "frames": "1-10", "image": {"width": 256, "height": 256},
 "methods": ["traced", {"method": "second_order", "level_error": 0}], "errors": {"against": ["traced"]}}
```

`catoptric render configs/demo.json` renders a config, and `catoptric render room.glb` a scene with the
defaults of this page.

**Changes on the command line.** `--set image.width=256` replaces a value, and
`--set methods.traced.bvh=refit` an option of the method with that name. Lists are JSON:
`--set 'image.layers=["Z"]'`.

**File names** in a config are relative to the config. Names on the command line, and in a config from
standard input (`catoptric render -`), are relative to the current folder.

**Frames** start at 1. `1-100x2,120` means every second frame from 1 to 100, and frame 120.

**Errors.** Unknown and repeated names and values out of range are errors. Editors that know JSON Schema
check a config that begins with `"$schema": "schema/run.schema.json"`.

In the lists, parentheses give the default, then other allowed values; brackets say what an empty value
means. s is a surface's reflectance, g its roughness: a mirror up to 0.05 (glTF: 0.03), rough above.

)";

/// The fields that every method has, in the words of the first one.
config::Schema commonSchema(const std::vector<methods::MethodEntry>& registry) {
  config::Schema common = methodSchema(registry.front());
  common.name = "every method";
  common.help.clear();
  common.fields.resize(common.fields.size() - registry.front().options.fields.size());
  std::erase_if(common.fields, [](const config::Field& f) { return f.name == "unsupported"; });
  for (config::Field& field : common.fields) {
    if (field.name == "name") field.defaultText.clear();
    if (field.name == "method") field.allowed.clear();
  }
  return common;
}

std::string methodLists(const std::vector<methods::MethodEntry>& registry) {
  const config::Schema common = commonSchema(registry);
  config::SharedLines lines;
  for (const methods::MethodEntry& entry : registry)
    for (const config::Field& field : methodSchema(entry).fields)
      if (std::none_of(common.fields.begin(), common.fields.end(),
                       [&](const config::Field& known) { return known.name == field.name; }))
        lines.add(entry.id, config::markdownLine(field));
  std::string text = config::markdownList(common) + "### several methods\n" + lines.shared();
  for (const methods::MethodEntry& entry : registry)
    text += "\n### " + entry.id + "\n\n" + entry.summary + "\n\n" +
            lines.of(entry.id, "#several-methods");
  return text;
}

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
    for (const methods::MethodAlias& alias : entry.aliases)
      ids.push_back(config::jsonString(alias.id));
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
  const std::string text = config::markdownList(schemaOf(name));
  return name == "run" ? kRunPreface + text + methodLists(registry) : text;
}

}  // namespace catoptric::run
