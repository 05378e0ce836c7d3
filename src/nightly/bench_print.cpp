#include "nightly/bench_print.h"

#include <map>
#include <set>
#include <sstream>

#include "config/json.h"
#include "core/file.h"
#include "core/hash.h"
#include "run/config/run_config.h"

namespace catoptric::nightly {
namespace {

namespace fs = std::filesystem;
using config::Value;

bool isJson(const fs::path& file) {
  return file.extension() == ".json" || file.extension() == ".gltf";
}

void addFile(const fs::path& file, std::set<fs::path>& known, Fingerprint& print);

/// Files that a value's texts name, relative to `folder`.
void addNamed(const Value& value, const fs::path& folder, std::set<fs::path>& known,
              Fingerprint& print) {
  if (value.kind() == Value::Kind::Array)
    for (const Value& item : value.asArray()) addNamed(item, folder, known, print);
  if (value.kind() == Value::Kind::Object)
    for (const std::string& key : value.keys())
      if (key != "$schema") addNamed(value.get(key), folder, known, print);
  if (value.kind() != Value::Kind::String || value.asString().empty()) return;
  std::error_code ignored;
  if (value.asString().size() < 1000 && fs::is_regular_file(folder / value.asString(), ignored))
    addFile(folder / value.asString(), known, print);
}

void addFile(const fs::path& file, std::set<fs::path>& known, Fingerprint& print) {
  if (!known.insert(fs::weakly_canonical(file)).second) return;
  if (!isJson(file)) {
    print.add(std::span<const std::byte>(readFile(file)));
    return;
  }
  const Value root = config::parseFile(file);
  print.add(config::without(root, {"comment", "$schema"}).dump());
  addNamed(root, file.parent_path(), known, print);
}

/// "image.width 512", a line for each value.
void describe(const Value& value, const std::string& name, std::string& text) {
  if (value.kind() != Value::Kind::Object) {
    text += name + " " + value.dump() + "\n";
    return;
  }
  for (const std::string& key : value.keys())
    if (key != "comment") describe(value.get(key), (name.empty() ? "" : name + ".") + key, text);
}

std::map<std::string, std::string> linesOf(const std::string& text) {
  std::map<std::string, std::string> lines;
  std::istringstream all(text);
  for (std::string line; std::getline(all, line);) {
    const std::size_t space = line.find(' ');
    lines[line.substr(0, space)] = space == std::string::npos ? "" : line.substr(space + 1);
  }
  return lines;
}

}  // namespace

std::string filesPrint(const fs::path& file) {
  std::set<fs::path> known;
  Fingerprint print;
  addFile(file, known, print);
  return print.text();
}

std::string describeCase(const NightCase& one) {
  std::string text;
  const bool bare = run::isScene(one.scene.config);
  const Value root = bare ? Value() : config::parseFile(one.scene.config);
  text += "method \"" + one.method + "\"\n";
  if (!bare) {
    describe(config::without(root, {"$schema", "comment", "methods", "errors", "frames", "scene",
                                    "path", "preview", "threads"}),
             "", text);
    for (const Value& entry :
         root.has("methods") ? root.get("methods").asArray() : std::vector<Value>{}) {
      if (entry.kind() != Value::Kind::Object) continue;
      if (run::entryName(entry) == one.method) describe(entry, "method", text);
    }
  }
  for (const auto& [name, value] : one.scene.settings) {
    const bool ofOther =
        name.starts_with("methods.") && !name.starts_with("methods." + one.method + ".");
    if (!ofOther) text += "set:" + name + " " + value + "\n";
  }
  return text;
}

std::string sceneLinesOf(const std::string& description) {
  std::string text;
  for (const auto& [name, value] : linesOf(description))
    if (name == "scene" || name == "path" || name == "camera" || name == "environment_file")
      text += name + " " + value + "\n";
  return text;
}

std::string differenceOf(const std::string& before, const std::string& after) {
  const std::map<std::string, std::string> from = linesOf(before);
  const std::map<std::string, std::string> to = linesOf(after);
  std::string text;
  const auto add = [&](const std::string& line) { text += (text.empty() ? "" : ", ") + line; };
  for (const auto& [name, value] : to) {
    const auto found = from.find(name);
    if (found == from.end())
      add(name + " " + value + " (new)");
    else if (found->second != value)
      add(name + " " + found->second + " -> " + value);
  }
  for (const auto& [name, value] : from)
    if (!to.contains(name)) add(name + " " + value + " (gone)");
  return text;
}

}  // namespace catoptric::nightly
