// What stands behind config::Value; for the sources of this module only.
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
  bool isInteger = false;                               ///< `integer` holds the number exactly
  std::pair<std::size_t, std::size_t> textRange{0, 0};  ///< of a number
  std::int64_t integer = 0;
  std::string string;
  std::vector<Value> array;
  std::vector<std::pair<std::string, Value>> members;  ///< in the order of the file
  std::string missing;  ///< the asked-for key, when this stands for an absent member
};

/// A member's name as it stands in a JSON pointer: ~ and / escaped (RFC 6901).
std::string escapedPointerToken(const std::string& name);

/// The value as a person should see it in a message: JSON text, shortened when long.
std::string shortText(const Value& value);

}  // namespace catoptric::config
