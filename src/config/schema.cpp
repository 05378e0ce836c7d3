// Schemas: checks, JSON Schema text and documentation tables from one description.
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <span>
#include <sstream>
#include <utility>

#include "config/json.h"
#include "config/json_text.h"
#include "config/node.h"
#include "config/pages.h"
#include "core/error.h"
#include "core/text.h"

namespace catoptric::config {
namespace {

using OrderedJson = nlohmann::ordered_json;

std::string limitText(double number) {
  if (std::trunc(number) == number && std::abs(number) < 1e15)
    return std::to_string(static_cast<long long>(number));
  return OrderedJson(number).dump();
}

/// "1 to 16384", "at least 0", "at most 1"; empty without limits.
std::string rangeText(const Field& field) {
  if (field.minimum && field.maximum)
    return limitText(*field.minimum) + " to " + limitText(*field.maximum);
  if (field.minimum) return "at least " + limitText(*field.minimum);
  if (field.maximum) return "at most " + limitText(*field.maximum);
  return "";
}

const char* typeText(FieldType type) {
  switch (type) {
    case FieldType::Bool:
      return "true or false";
    case FieldType::Integer:
      return "an integer";
    case FieldType::Number:
      return "a number";
    case FieldType::String:
      return "a string";
    case FieldType::Vec3:
      return "an array of 3 numbers";
    case FieldType::Numbers:
      return "an array of numbers";
    case FieldType::Array:
      return "an array";
    case FieldType::Object:
      return "an object";
    case FieldType::Any:
      return "a value";
  }
  return "";
}

std::vector<std::string> fieldNames(const Schema& schema) {
  std::vector<std::string> names;
  for (const Field& field : schema.fields) names.push_back(field.name);
  return names;
}

/// Collects the errors of one document.
class Checker {
 public:
  void object(const Value& value, const Schema& schema) {
    if (value.kind() != Value::Kind::Object) {
      wrongKind(value, "an object");
      return;
    }
    const std::vector<std::string> names = fieldNames(schema);
    for (const std::string& key : value.keys()) {
      const auto field = std::find_if(schema.fields.begin(), schema.fields.end(),
                                      [&](const Field& f) { return f.name == key; });
      if (field != schema.fields.end()) {
        member(value.get(key), *field);
      } else if (!schema.open) {
        add(value.get(key), "unknown name \"" + key + "\"" + didYouMean(key, names) +
                                "; allowed: " + joined(names, ", "));
      }
    }
    for (const Field& field : schema.fields)
      if (field.required && !value.has(field.name))
        add(value, "\"" + field.name + "\" is missing; expected " + typeText(field.type));
  }

  std::vector<std::string> take() { return std::move(lines_); }

 private:
  void add(const Value& value, const std::string& message) {
    lines_.push_back(value.place().text() + ": " + message);
  }
  void wrongKind(const Value& value, const std::string& wanted) {
    add(value, shortText(value) + " is not " + wanted);
  }

  void number(const Value& value, const Field& field) {
    if (value.kind() != Value::Kind::Number) {
      wrongKind(value, "a number");
      return;
    }
    const double number = value.asNumber();
    if ((field.minimum && number < *field.minimum) || (field.maximum && number > *field.maximum))
      add(value, shortText(value) + " is out of range; allowed: " + rangeText(field));
    // Most are stored as floats
    else if (std::abs(number) > static_cast<double>(std::numeric_limits<float>::max()))
      add(value, shortText(value) + " is too large (the limit is 3.4e38)");
  }

  void string(const Value& value, const Field& field) {
    if (value.kind() != Value::Kind::String) {
      wrongKind(value, field.allowed.empty() ? "a string"
                                             : "a string; allowed: " + joined(field.allowed, ", "));
      return;
    }
    const std::string& text = value.asString();
    if (!field.allowed.empty() &&
        std::find(field.allowed.begin(), field.allowed.end(), text) == field.allowed.end())
      add(value, shortText(value) + " is not allowed" + didYouMean(text, field.allowed) +
                     "; allowed: " + joined(field.allowed, ", "));
  }

  /// Where a single item stands instead of an array: the array of it, as it is to be written.
  static std::string arrayHint(const Value& value, const Field& field) {
    if (value.kind() != Value::Kind::String || field.items != FieldType::String) return "";
    const std::string item = "[" + value.dump() + "]";
    const std::string& file = value.place().file;
    const std::size_t equals = file.find('=');
    if (!file.starts_with("--set ") || equals == std::string::npos)
      return "; did you mean " + item + "?";
    return "; did you mean --set '" + file.substr(6, equals - 5) + item + "'?";
  }

  void array(const Value& value, const Field& field) {
    if (value.kind() != Value::Kind::Array) {
      wrongKind(value, "an array" + arrayHint(value, field));
      return;
    }
    const auto size = static_cast<double>(value.asArray().size());
    if ((field.minimum && size < *field.minimum) || (field.maximum && size > *field.maximum))
      add(value, "has " + limitText(size) + " items; allowed: " + rangeText(field));
    Field item = field;
    item.type = field.object != nullptr ? FieldType::Object : field.items;
    item.items = FieldType::Any;
    item.minimum.reset();
    item.maximum.reset();
    for (const Value& inner : value.asArray()) member(inner, item);
  }

  void numbers(const Value& value, const Field& field) {
    const bool isArray = value.kind() == Value::Kind::Array;
    const bool isVec3 = field.type == FieldType::Vec3;
    if (!isArray || (isVec3 && value.asArray().size() != 3)) {
      wrongKind(value, typeText(field.type));
      return;
    }
    for (const Value& item : value.asArray()) number(item, field);
  }

  void member(const Value& value, const Field& field) {
    switch (field.type) {
      case FieldType::Bool:
        if (value.kind() != Value::Kind::Bool) wrongKind(value, "true or false");
        break;
      case FieldType::Integer:
        if (value.kind() != Value::Kind::Number || !value.node().isInteger) {
          wrongKind(value, "an integer");
        } else {
          number(value, field);
        }
        break;
      case FieldType::Number:
        number(value, field);
        break;
      case FieldType::String:
        string(value, field);
        break;
      case FieldType::Vec3:
      case FieldType::Numbers:
        numbers(value, field);
        break;
      case FieldType::Array:
        array(value, field);
        break;
      case FieldType::Object:
        if (field.object != nullptr) {
          object(value, *field.object);
        } else if (value.kind() != Value::Kind::Object) {
          wrongKind(value, "an object");
        }
        break;
      case FieldType::Any:
        break;
    }
  }

  std::vector<std::string> lines_;
};

OrderedJson fieldJsonSchema(const Field& field, std::vector<const Schema*>& used) {
  OrderedJson json = OrderedJson::object();
  if (!field.help.empty()) json["description"] = field.help;
  const auto addRange = [&](OrderedJson& target) {
    if (field.minimum) target["minimum"] = OrderedJson::parse(limitText(*field.minimum));
    if (field.maximum) target["maximum"] = OrderedJson::parse(limitText(*field.maximum));
  };
  const auto reference = [&](const Schema& schema) {
    if (std::find(used.begin(), used.end(), &schema) == used.end()) used.push_back(&schema);
    return "#/$defs/" + schema.name;
  };
  switch (field.type) {
    case FieldType::Bool:
      json["type"] = "boolean";
      break;
    case FieldType::Integer:
      json["type"] = "integer";
      addRange(json);
      break;
    case FieldType::Number:
      json["type"] = "number";
      addRange(json);
      break;
    case FieldType::String:
      json["type"] = "string";
      if (!field.allowed.empty()) json["enum"] = field.allowed;
      break;
    case FieldType::Vec3:
    case FieldType::Numbers:
      json["type"] = "array";
      json["items"] = {{"type", "number"}};
      addRange(json["items"]);
      if (field.type == FieldType::Vec3) {
        json["minItems"] = 3;
        json["maxItems"] = 3;
      }
      break;
    case FieldType::Array: {
      json["type"] = "array";
      if (field.minimum) json["minItems"] = static_cast<long long>(*field.minimum);
      if (field.maximum) json["maxItems"] = static_cast<long long>(*field.maximum);
      Field item;
      item.type = field.object != nullptr ? FieldType::Object : field.items;
      item.object = field.object;
      item.allowed = field.allowed;
      json["items"] = fieldJsonSchema(item, used);
      break;
    }
    case FieldType::Object:
      if (field.object != nullptr) {
        json["$ref"] = reference(*field.object);
      } else {
        json["type"] = "object";
      }
      break;
    case FieldType::Any:
      break;
  }
  if (!field.defaultText.empty()) json["default"] = OrderedJson::parse(field.defaultText);
  return json;
}

OrderedJson objectJsonSchema(const Schema& schema, std::vector<const Schema*>& used) {
  OrderedJson json = OrderedJson::object();
  if (!schema.help.empty()) json["description"] = schema.help;
  json["type"] = "object";
  json["properties"] = OrderedJson::object();
  OrderedJson required = OrderedJson::array();
  for (const Field& field : schema.fields) {
    json["properties"][field.name] = fieldJsonSchema(field, used);
    if (field.required) required.push_back(field.name);
  }
  if (!required.empty()) json["required"] = required;
  json["additionalProperties"] = schema.open;
  return json;
}

/// Of a field without a default: "a string", "list of item", ...
std::string kindText(const Field& field) {
  if (field.object == nullptr) return typeText(field.type);
  return (field.type == FieldType::Array ? "list of " : "object: ") + field.object->name;
}

void appendList(const Schema& schema, std::string& text, std::vector<const Schema*>& done) {
  done.push_back(&schema);
  text += "### " + schema.name + "\n\n";
  if (!schema.help.empty()) text += schema.help + "\n\n";
  for (const Field& field : schema.fields) text += markdownLine(field);
  if (!schema.fields.empty()) text += "\n";
  for (const Field& field : schema.fields)
    if (field.object != nullptr && !field.object->fields.empty() &&
        std::find(done.begin(), done.end(), field.object) == done.end())
      appendList(*field.object, text, done);
}

}  // namespace

std::vector<std::string> check(const Value& value, const Schema& schema) {
  Checker checker;
  checker.object(value, schema);
  return checker.take();
}

void require(const Value& value, const Schema& schema) {
  Errors errors;
  errors.add(check(value, schema));
  errors.throwIfAny();
}

void Errors::addLine(const std::string& line) {
  if (known_.insert(line).second) lines_.push_back(line);
}

void Errors::add(const Value& at, const std::string& message) {
  addLine(at.place().text() + ": " + message);
}

void Errors::add(const std::vector<std::string>& messages) {
  for (const std::string& message : messages) addLine(message);
}

void Errors::collect(const std::function<void()>& body) {
  try {
    body();
  } catch (const Error& error) {
    if (error.code() != ExitCode::Usage && error.code() != ExitCode::Scene) throw;
    std::istringstream lines(error.what());
    for (std::string line; std::getline(lines, line);) addLine(line);
  }
}

void Errors::throwIfAny() const {
  constexpr std::size_t kMost = 20;
  if (lines_.empty()) return;
  std::string text = joined(std::span(lines_).first(std::min(kMost, lines_.size())), "\n");
  if (lines_.size() > kMost) text += "\n... and " + std::to_string(lines_.size() - kMost) + " more";
  throw UsageError(text);
}

Value valueOr(const Value& object, const Schema& schema, const std::string& field) {
  if (object.has(field)) return object.get(field);
  for (const Field& f : schema.fields) {
    if (f.name != field || f.defaultText.empty()) continue;
    // Defaults stay: callers hold references into them (valueOr(...).asArray())
    static std::mutex mutex;
    static std::map<std::pair<std::string, std::string>, Value> defaults;
    const std::lock_guard lock(mutex);
    const std::string name = "default of " + schema.name + "." + field;
    const auto [entry, isNew] = defaults.try_emplace({name, f.defaultText});
    if (isNew) entry->second = parseText(f.defaultText, name);
    return entry->second;
  }
  return object.get(field);
}

namespace {

/// The object's members, with defaults; objects inside likewise.
std::string completedText(const Value& object, const Schema& schema) {
  JsonText text;
  for (const Field& field : schema.fields) {
    const Value value = valueOr(object, schema, field.name);
    if (field.object != nullptr && field.type == FieldType::Object) {
      text.raw(field.name, completedText(value, *field.object));
    } else if (field.object != nullptr && value.kind() == Value::Kind::Array) {
      std::vector<std::string> items;
      for (const Value& item : value.asArray()) items.push_back(completedText(item, *field.object));
      text.raw(field.name, "[" + joined(items, ",") + "]");
    } else if (!value.isNull()) {
      text.raw(field.name, value.dump());
    }
  }
  if (schema.open && object.kind() == Value::Kind::Object)
    for (const std::string& key : object.keys())
      if (std::none_of(schema.fields.begin(), schema.fields.end(),
                       [&](const Field& f) { return f.name == key; }))
        text.raw(key, object.get(key).dump());
  return text.object();
}

}  // namespace

std::string withDefaults(const Value& object, const Schema& schema) {
  return parseText(completedText(object, schema), schema.name).dump();
}

std::string jsonSchema(const Schema& schema) {
  OrderedJson json = OrderedJson::object();
  json["$schema"] = "https://json-schema.org/draft/2020-12/schema";
  json["title"] = schema.name;
  std::vector<const Schema*> used;
  json.update(objectJsonSchema(schema, used));
  // Definitions may name further ones while they are written.
  OrderedJson definitions = OrderedJson::object();
  for (std::size_t i = 0; i < used.size(); ++i) {
    const Schema* definition = used[i];
    definitions[definition->name] = objectJsonSchema(*definition, used);
  }
  if (!definitions.empty()) json["$defs"] = definitions;
  return json.dump(2) + "\n";
}

std::string fieldText(const Field& field) {
  std::string first = kindText(field);
  if (field.required) first = "required";
  if (!field.defaultText.empty()) first = "`" + field.defaultText + "`";
  std::vector<std::string> others;
  for (const std::string& name : field.allowed)
    if (jsonString(name) != field.defaultText) others.push_back(name);
  const std::string allowed = field.allowed.empty() ? rangeText(field) : joined(others, ", ");
  return "(" + first + (allowed.empty() ? "" : "; " + allowed) + "): " + field.help;
}

std::string markdownLine(const Field& field) {
  return "- `" + field.name + "` " + fieldText(field) + "\n";
}

std::string markdownList(const Schema& schema) {
  std::string text;
  std::vector<const Schema*> done;
  appendList(schema, text, done);
  return text;
}

}  // namespace catoptric::config
