#include "run/config/method_config.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <set>

#include "config/fields.h"
#include "core/error.h"
#include "core/text.h"
#include "run/folder/run_folder.h"

namespace catoptric::run {
namespace {

using config::Errors, config::Field, config::Schema, config::Value;
namespace fields = config::fields;

std::vector<std::string> methodIds(const std::vector<methods::MethodEntry>& registry) {
  std::vector<std::string> ids;
  for (const methods::MethodEntry& entry : registry) {
    ids.push_back(entry.id);
    for (const methods::MethodAlias& alias : entry.aliases) ids.push_back(alias.id);
  }
  return ids;
}

/// What an alias stands for: the method with its option; an entry has the alias's name.
Value withoutAlias(const Value& value, const methods::MethodEntry& entry, const std::string& id,
                   bool isEntry) {
  const auto alias = std::ranges::find(entry.aliases, id, &methods::MethodAlias::id);
  Value result =
      value.kind() == Value::Kind::Object ? value : config::parseText("{}", value.place().file);
  result = config::withSetting(result, "method", config::jsonString(entry.id));
  if (isEntry && !result.has("name"))
    result = config::withSetting(result, "name", config::jsonString(id));
  return result.has(alias->option) ? result
                                   : config::withSetting(result, alias->option, alias->value);
}

/// What an entry of `methods` can have, and a method of `reflectors` cannot.
constexpr std::array<std::string_view, 3> kOfEntries = {"name", "reflectors", "unsupported"};

bool isFileName(const std::string& name) {
  return !name.empty() && name.front() != '.' &&
         std::all_of(name.begin(), name.end(), [](unsigned char c) {
           return std::isalnum(c) != 0 || c == '_' || c == '-' || c == '.';
         });
}

std::optional<MethodConfig> readMethod(const Value& value,
                                       const std::vector<methods::MethodEntry>& registry,
                                       Errors& errors, bool isEntry);

/// The member `reflectors` of an entry: {"NAME": method, ...}.
std::vector<ReflectorRule> readReflectors(const Value& value,
                                          const std::vector<methods::MethodEntry>& registry,
                                          Errors& errors) {
  std::vector<ReflectorRule> rules;
  for (const std::string& pattern : value.isNull() ? std::vector<std::string>{} : value.keys()) {
    const Value member = value.get(pattern);
    const std::size_t star = pattern.find('*');
    if (pattern.empty() || (star != std::string::npos && star + 1 != pattern.size())) {
      errors.add(member, config::jsonString(pattern) +
                             ": allowed are an object's name, and the beginning of names with * "
                             "at its end");
      continue;
    }
    const auto* const wrong = std::ranges::find_if(kOfEntries, [&](std::string_view name) {
      return member.kind() == Value::Kind::Object && member.has(std::string(name));
    });
    if (wrong != kOfEntries.end()) {
      errors.add(member, config::jsonString(*wrong) +
                             " is for entries of methods: a method of some reflectors has "
                             "\"method\" and the method's own options alone");
      continue;
    }
    const std::optional<MethodConfig> method = readMethod(member, registry, errors, false);
    if (method) rules.push_back({pattern, method->id, method->options, method->effective, member});
  }
  return rules;
}

/// The option `fallback` that methods with leavesSamples have.
const Field& fallbackOf(const methods::MethodEntry& method) {
  return *std::ranges::find(method.options.fields, "fallback", &Field::name);
}

/// Whether an entry's `fallback` names a method, in place of one of the option's own values.
bool fallbackIsMethod(const Value& entry, const methods::MethodEntry& method) {
  if (!method.leavesSamples || !entry.has("fallback")) return false;
  const Value value = entry.get("fallback");
  const std::vector<std::string>& own = fallbackOf(method).allowed;
  return value.kind() != Value::Kind::String ||
         std::ranges::find(own, value.asString()) == own.end();
}

/// The method of an entry's `fallback`.
std::optional<MethodConfig> readFallback(const Value& value, const methods::MethodEntry& entry,
                                         const std::vector<methods::MethodEntry>& registry,
                                         Errors& errors) {
  if (value.kind() == Value::Kind::Object && value.has("name")) {
    errors.add(value.get("name"), "is for entries of methods: a fallback has no folder of its own");
    return {};
  }
  if (value.kind() == Value::Kind::String &&
      methods::findMethod(registry, value.asString()) == nullptr) {
    std::vector<std::string> names = fallbackOf(entry).allowed;
    for (const std::string& id : methodIds(registry))
      if (id != entry.id && std::ranges::find(names, id) == names.end()) names.push_back(id);
    errors.add(value, value.dump() + " is not allowed" + didYouMean(value.asString(), names) +
                          "; allowed: " + joined(names, ", ") + ", or an object with \"method\"");
    return {};
  }
  std::optional<MethodConfig> method = readMethod(value, registry, errors, true);
  if (!method) return {};
  const auto rule = std::ranges::find(method->reflectors, entry.id, &ReflectorRule::id);
  if (method->id != entry.id && rule == method->reflectors.end()) return method;
  errors.add(method->id == entry.id ? value : rule->place,
             entry.id + " would find nothing there either; name another method");
  return {};
}

/// A method of `methods` or `reflectors`: "traced" or {"method": "traced", ...}. Nothing when it
/// has errors.
std::optional<MethodConfig> readMethod(const Value& value,
                                       const std::vector<methods::MethodEntry>& registry,
                                       Errors& errors, bool isEntry) {
  const std::vector<std::string> ids = methodIds(registry);
  const bool isName = value.kind() == Value::Kind::String;
  if (!isName && value.kind() != Value::Kind::Object) {
    errors.add(value, value.dump() + " is neither a method's name nor an object with \"method\"");
    return {};
  }
  const Value idValue = isName ? value : value.get("method");
  if (idValue.isNull()) {
    errors.add(value, "\"method\" is missing; expected one of: " + joined(ids, ", "));
    return {};
  }
  if (idValue.kind() != Value::Kind::String) {
    errors.add(idValue, idValue.dump() + " is not a method's name; allowed: " + joined(ids, ", "));
    return {};
  }
  const std::string& id = idValue.asString();
  const methods::MethodEntry* entry = methods::findMethod(registry, id);
  if (entry == nullptr) {
    errors.add(idValue, idValue.dump() + " is not a method" + didYouMean(id, ids) +
                            "; allowed: " + joined(ids, ", "));
    return {};
  }
  if (entry->id != id)
    return readMethod(withoutAlias(value, *entry, id, isEntry), registry, errors, isEntry);

  MethodConfig method;
  method.id = id;
  method.name = id;
  method.place = value;
  if (isName) {
    method.options = config::parseText("{}", value.place().file);
  } else {
    const bool hybrid = isEntry && fallbackIsMethod(value, *entry);
    const Value own = hybrid ? config::without(value, {"fallback"}) : value;
    const std::vector<std::string> lines = config::check(own, methodSchema(*entry, isEntry));
    errors.add(lines);
    if (hybrid) {
      std::optional<MethodConfig> fallback =
          readFallback(value.get("fallback"), *entry, registry, errors);
      if (!fallback) return {};
      method.fallback.push_back(std::move(*fallback));
    }
    if (!lines.empty()) return {};
    if (value.has("name")) method.name = value.get("name").asString();
    method.reflectors = readReflectors(value.get("reflectors"), registry, errors);
    if (value.has("unsupported")) method.unsupported = value.get("unsupported").asString();
    method.options =
        config::without(own, {"method", "name", "comment", "reflectors", "unsupported"});
  }
  if (!isFileName(method.name)) {
    errors.add(value.get("name"), config::jsonString(method.name) +
                                      " cannot name a folder; allowed: letters, digits, _ - .");
    return {};
  }
  if (isRunFileName(method.name)) {
    errors.add(value.get("name"), config::jsonString(method.name) +
                                      " is the name of a run's own file; choose another");
    return {};
  }
  method.effective = config::withDefaults(method.options, entry->options);
  return method;
}

/// The fields of entries that say which other methods shade beside theirs.
void addOfEntries(Schema& schema, const methods::MethodEntry& entry) {
  static const Schema reflectors{.name = "reflectors", .help = "", .fields = {}, .open = true};
  schema.fields.push_back(fields::object(
      "reflectors",
      "Other methods for some reflective objects: {\"NAME\": \"traced\", \"lamp*\": "
      "{\"method\": \"traced\", \"rays\": 16}}. * at the end of a NAME stands for any text; "
      "`planar`, `curved` (mirrors) and `glossy` stand for all reflectors of a kind. A full name "
      "wins over a pattern, a longer pattern over a shorter one, a kind over * alone.",
      &reflectors));
  if (entry.refusesReflectors) {
    std::vector<std::string> allowed = fallbackMethods();
    allowed.insert(allowed.begin(), "error");
    schema.fields.push_back(
        fields::choice("unsupported",
                       "What happens to reflectors that the method cannot render. error: the run "
                       "ends; environment_map, traced: that method renders them (counter "
                       "unsupported_reflector).",
                       "\"error\"", allowed));
  }
}

}  // namespace

std::vector<std::string> fallbackMethods() {
  std::vector<std::string> names;
  for (const methods::MethodEntry& entry : methods::registry())
    if (entry.fallbackOptions != nullptr) names.push_back(entry.id);
  return names;
}

Schema methodSchema(const methods::MethodEntry& entry, bool isEntry) {
  Schema schema{entry.id, entry.summary, {}};
  std::vector<std::string> ids = {entry.id};
  for (const methods::MethodAlias& alias : entry.aliases) ids.push_back(alias.id);
  schema.fields.push_back(
      fields::required(fields::choice("method", "The method.", "", std::move(ids))));
  if (isEntry)
    schema.fields.push_back(
        fields::text("name", "Name of its folder and of its table rows [the method's name].",
                     config::jsonString(entry.id)));
  schema.fields.push_back(fields::any("comment", "Any text; ignored."));
  if (isEntry) addOfEntries(schema, entry);
  schema.fields.insert(schema.fields.end(), entry.options.fields.begin(),
                       entry.options.fields.end());
  if (isEntry && entry.leavesSamples)
    std::ranges::find(schema.fields, "fallback", &Field::name)->type = config::FieldType::Any;
  return schema;
}

void MethodConfig::addSettings(config::JsonText& text) const {
  text.add("method", id).raw("options", effective);
  if (!reflectors.empty()) {
    config::JsonText rules;
    for (const ReflectorRule& rule : reflectors)
      rules.raw(rule.pattern,
                config::JsonText().add("method", rule.id).raw("options", rule.effective).object());
    text.raw("reflectors", rules.object());
  }
  if (unsupported != "error") text.add("unsupported", unsupported);
  for (const MethodConfig& method : fallback) {
    config::JsonText settings;
    method.addSettings(settings);
    text.raw("fallback", settings.object());
  }
}

std::vector<MethodConfig> readMethods(const Value& methods,
                                      const std::vector<methods::MethodEntry>& registry,
                                      Errors& errors) {
  std::vector<MethodConfig> result;
  if (methods.kind() != Value::Kind::Array) return result;
  std::set<std::string> names;
  for (const Value& entry : methods.asArray()) {
    std::optional<MethodConfig> method = readMethod(entry, registry, errors, true);
    if (!method) continue;
    if (!names.insert(method->name).second)
      errors.add(entry, "two methods are called \"" + method->name +
                            "\"; give one of them another \"name\"");
    result.push_back(std::move(*method));
  }
  return result;
}

std::vector<MethodConfig> selectMethods(const std::vector<MethodConfig>& all,
                                        const std::vector<std::string>& selected,
                                        const std::vector<methods::MethodEntry>& registry,
                                        Errors& errors) {
  std::vector<MethodConfig> chosen;
  for (const std::string& name : selected) {
    const std::size_t before = chosen.size();
    for (const MethodConfig& method : all)
      if (method.name == name) chosen.push_back(method);
    if (chosen.size() == before)
      for (const MethodConfig& method : all)
        if (method.id == name) chosen.push_back(method);
    if (chosen.size() > before) continue;
    std::vector<std::string> allowed = methodIds(registry);
    for (const MethodConfig& method : all)
      if (methods::findMethod(registry, method.name) == nullptr) allowed.push_back(method.name);
    if (methods::findMethod(registry, name) == nullptr)
      throw UsageError("--method: \"" + name + "\" is not a method" + didYouMean(name, allowed) +
                       "; allowed: " + joined(allowed, ", "));
    chosen.push_back(*readMethod(config::parseText(config::jsonString(name), "--method"), registry,
                                 errors, true));
  }
  for (std::size_t i = 0; i < chosen.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      if (chosen[i].name == chosen[j].name)
        throw UsageError("--method: \"" + chosen[i].name + "\" is named twice");
  return chosen;
}

std::string entryName(const Value& entry) {
  if (entry.kind() == Value::Kind::String) return entry.asString();
  const Value name = entry.get(entry.has("name") ? "name" : "method");
  return name.isNull() ? "" : name.asString();
}

}  // namespace catoptric::run
