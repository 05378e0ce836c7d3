#include "scene/environment.h"

#include "core/error.h"
#include "core/nearest_file.h"
#include "scene/daylight.h"
#include "scene/procedural/procedural.h"

namespace catoptric::scene {

Environment namedEnvironment(const config::Value& text, const std::filesystem::path& file) {
  const std::string& name = text.asString();
  Environment environment;
  if (name == "sky") {
    environment = defaultEnvironment();
    environment.isDefault = false;
  } else if (name.starts_with("#")) {
    environment.color = colorOf(text);
  } else if (!name.empty() && name.find_first_not_of("0123456789.,+-eE ") == std::string::npos) {
    config::Value color;
    try {
      color = config::parseText("[" + name + "]", "colour");
      environment.color = colorOf(color);
    } catch (const UsageError&) {
      text.fail("\"" + name +
                "\" is not a colour of three numbers from 0 to 1e9, such as 0.5,0.5,0.5");
    }
  } else {
    environment.type = EnvironmentType::File;
    environment.file = file;
    std::error_code error;
    if (!std::filesystem::is_regular_file(file, error)) {
      text.fail((std::filesystem::is_directory(file, error) ? file.string() + " is a folder"
                 : std::filesystem::exists(file, error) ? file.string() + " is not a regular file"
                                                        : noFileText(file)) +
                "; an environment is an image, a colour (\"#8090a0\" or \"0.5,0.5,0.5\"), or "
                "\"sky\"");
    }
  }
  return environment;
}

}  // namespace catoptric::scene
