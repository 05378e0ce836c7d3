// The data behind config::Value; private to this module.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "config/json.h"

namespace catoptric::config {

struct Value::Node {
  Kind kind = Kind::Null;
  Place place;
  bool boolean = false;
  double number = 0.0;
  bool isInteger = false;                               ///< `integer` is the exact number
  std::pair<std::size_t, std::size_t> textRange{0, 0};  ///< for a number only
  std::int64_t integer = 0;
  std::string string;
  std::vector<Value> array;
  std::vector<std::pair<std::string, Value>> members;  ///< in file order
  std::string missing;                                 ///< for an absent member: the requested key
};

/// A member's name as written in a JSON pointer: ~ and / are escaped (RFC 6901).
std::string escapedPointerToken(const std::string& name);

/// The value for a message to the user: JSON text, shortened if long.
std::string shortText(const Value& value);

}  // namespace catoptric::config
