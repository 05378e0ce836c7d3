#include "run/schemas.h"

#include "config/json.h"
#include "config/json_text.h"
#include "core/error.h"
#include "core/text.h"
#include "run/run_config.h"
#include "scene/description.h"
#include "scene/path.h"

namespace catoptric::run {
namespace {

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
  const std::string text = config::jsonSchema(schemaOf(name));
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
  for (const methods::MethodEntry& entry : registry)
    text += config::markdownTable(methodSchema(entry));
  return text;
}

}  // namespace catoptric::run
