// Functions that make schema fields in one or two lines.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "config/json.h"

namespace catoptric::config::fields {

inline Field of(FieldType type, std::string name, std::string help, std::string defaultText = "",
                std::optional<double> minimum = {}, std::optional<double> maximum = {}) {
  return {.name = std::move(name),
          .type = type,
          .help = std::move(help),
          .defaultText = std::move(defaultText),
          .minimum = minimum,
          .maximum = maximum};
}
inline Field number(const std::string& name, const std::string& help,
                    const std::string& defaultText = "", std::optional<double> minimum = {},
                    std::optional<double> maximum = {}) {
  return of(FieldType::Number, name, help, defaultText, minimum, maximum);
}
inline Field integer(const std::string& name, const std::string& help,
                     const std::string& defaultText, double minimum, double maximum) {
  return of(FieldType::Integer, name, help, defaultText, minimum, maximum);
}
inline Field numbers(const std::string& name, const std::string& help,
                     const std::string& defaultText = "", std::optional<double> minimum = {},
                     std::optional<double> maximum = {}) {
  return of(FieldType::Numbers, name, help, defaultText, minimum, maximum);
}
inline Field boolean(const std::string& name, const std::string& help,
                     const std::string& defaultText) {
  return of(FieldType::Bool, name, help, defaultText);
}
inline Field vec3(const std::string& name, const std::string& help,
                  const std::string& defaultText = "") {
  return of(FieldType::Vec3, name, help, defaultText);
}
inline Field any(const std::string& name, const std::string& help,
                 const std::string& defaultText = "") {
  return of(FieldType::Any, name, help, defaultText);
}
inline Field text(const std::string& name, const std::string& help,
                  const std::string& defaultText = "") {
  return of(FieldType::String, name, help, defaultText);
}
inline Field choice(const std::string& name, const std::string& help,
                    const std::string& defaultText, std::vector<std::string> allowed) {
  Field field = text(name, help, defaultText);
  field.allowed = std::move(allowed);
  return field;
}
/// `members`: the schema of the object's members; null: any members.
inline Field object(const std::string& name, const std::string& help,
                    const Schema* members = nullptr) {
  Field field = of(FieldType::Object, name, help);
  field.object = members;
  return field;
}
inline Field arrayOf(const std::string& name, const std::string& help, FieldType items,
                     std::optional<double> minimum = {}) {
  Field field = of(FieldType::Array, name, help, "", minimum);
  field.items = items;
  return field;
}
inline Field arrayOf(const std::string& name, const std::string& help, const Schema& members,
                     std::optional<double> minimum = {}) {
  Field field = of(FieldType::Array, name, help, "", minimum);
  field.object = &members;
  return field;
}
inline Field required(Field field) {
  field.required = true;
  return field;
}

}  // namespace catoptric::config::fields
