#include "config/json_text.h"

#include <array>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>

#include "core/text.h"

namespace catoptric::config {

std::string jsonString(std::string_view text) {
  return nlohmann::json(text).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

std::string numberText(double number) {
  return nlohmann::json(number).dump();
}

std::string numberText(float number) {
  if (!std::isfinite(number)) return "null";
  std::array<char, 32> digits{};
  const char* end = std::to_chars(digits.data(), digits.data() + digits.size(), number).ptr;
  // Read as a double, the same digits are written in JSON's form.
  double sameDigits = 0.0;
  std::from_chars(digits.data(), end, sameDigits);
  return numberText(sameDigits);
}

JsonText& JsonText::raw(std::string_view name, std::string_view json) {
  if (!text_.empty()) text_ += ",";
  text_ += jsonString(name) + ":";
  text_ += json;
  return *this;
}

JsonText& JsonText::add(std::string_view name, std::string_view text) {
  return raw(name, jsonString(text));
}
JsonText& JsonText::add(std::string_view name, double number) {
  return raw(name, numberText(number));
}
JsonText& JsonText::add(std::string_view name, float number) {
  return raw(name, numberText(number));
}
JsonText& JsonText::add(std::string_view name, int number) {
  return raw(name, std::to_string(number));
}
JsonText& JsonText::add(std::string_view name, std::uint64_t number) {
  return raw(name, std::to_string(number));
}
JsonText& JsonText::add(std::string_view name, bool value) {
  return raw(name, value ? "true" : "false");
}
JsonText& JsonText::add(std::string_view name, const std::map<std::string, std::string>& members) {
  JsonText inner;
  for (const auto& [key, value] : members) inner.add(key, value);
  return raw(name, inner.object());
}
JsonText& JsonText::add(std::string_view name,
                        const std::map<std::string, std::uint64_t>& members) {
  JsonText inner;
  for (const auto& [key, value] : members) inner.add(key, value);
  return raw(name, inner.object());
}
JsonText& JsonText::add(std::string_view name, const std::vector<std::string>& items) {
  std::vector<std::string> texts;
  for (const std::string& item : items) texts.push_back(jsonString(item));
  return raw(name, "[" + joined(texts, ",") + "]");
}
JsonText& JsonText::add(std::string_view name, const std::vector<int>& items) {
  std::vector<std::string> texts;
  for (const int item : items) texts.push_back(std::to_string(item));
  return raw(name, "[" + joined(texts, ",") + "]");
}

}  // namespace catoptric::config
