// Writes JSON text for records and summaries, member by member, in the order of addition.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace catoptric::config {

/// A JSON string literal, quotes included. Bytes that are not UTF-8 become U+FFFD.
std::string jsonString(std::string_view text);
/// The shortest text that reads back as the same number of its type; "null" if not finite.
std::string numberText(double number);
std::string numberText(float number);

/// Collects the members of one object.
class JsonText {
 public:
  JsonText& add(std::string_view name, std::string_view text);
  JsonText& add(std::string_view name, const char* text) {
    return add(name, std::string_view(text));
  }
  JsonText& add(std::string_view name, double number);
  JsonText& add(std::string_view name, float number);
  JsonText& add(std::string_view name, int number);
  JsonText& add(std::string_view name, std::uint64_t number);
  JsonText& add(std::string_view name, bool value);
  JsonText& add(std::string_view name, const std::map<std::string, std::string>& members);
  JsonText& add(std::string_view name, const std::map<std::string, std::uint64_t>& members);
  JsonText& add(std::string_view name, const std::vector<std::string>& items);
  JsonText& add(std::string_view name, const std::vector<int>& items);
  /// `json` is already JSON text.
  JsonText& raw(std::string_view name, std::string_view json);
  std::string object() const { return "{" + text_ + "}"; }

 private:
  std::string text_;
};

}  // namespace catoptric::config
