// JSON values that know their place: the line and the JSON pointer, so that every message about
// input can name them. nlohmann::json does the parsing. Duplicate keys, NaN, comments, zero bytes
// and excessive depth are errors.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "core/math.h"

namespace catoptric::config {

/// The place of a value.
struct Place {
  std::string file;
  int line = 0;         ///< 1-based; 0: not from a file (a --set option)
  std::string pointer;  ///< "/objects/3/material"
  /// For example "scenes/room.json:12: /objects/3/material".
  std::string text() const;
};

/// A parsed JSON value. It is cheap to copy (shared, immutable).
class Value {
 public:
  enum class Kind { Null, Bool, Number, String, Array, Object };

  Value();  ///< a null value
  Kind kind() const;
  const Place& place() const;

  // Typed access. A wrong type throws UsageError, with the place, the value and the type.
  bool asBool() const;
  double asNumber() const;
  std::int64_t asInteger() const;  ///< a number without fraction
  /// The byte range of a number's text in the parsed input [first, second).
  std::pair<std::size_t, std::size_t> textRange() const;
  const std::string& asString() const;
  const std::vector<Value>& asArray() const;
  Vec3 asVec3() const;  ///< array of 3 finite numbers
  std::vector<float> asFloats(std::size_t count) const;

  bool isNull() const { return kind() == Kind::Null; }
  bool has(const std::string& key) const;
  /// Member of an object. If it is absent: a null value with the place of the object.
  Value get(const std::string& key) const;
  std::vector<std::string> keys() const;    ///< in file order
  std::string dump(int indent = -1) const;  ///< canonical JSON text

  /// Throws UsageError "place: message".
  [[noreturn]] void fail(const std::string& message) const;

  struct Node;  // config/node.h; private to this module
  explicit Value(std::shared_ptr<const Node> node);
  const Node& node() const { return *node_; }

 private:
  std::shared_ptr<const Node> node_;
};

/// Parses a file or text. Throws UsageError with file, line, column and reason.
Value parseFile(const std::filesystem::path& file);
Value parseText(const std::string& text, const std::string& name);

/// A copy of `root` in which the value at the dotted path "a.b" is replaced or added; array items
/// are given by number: "methods.0.bvh". `valueText` is parsed as JSON, or taken as a string if
/// that fails. `origin` stands for the file in messages; empty: "--set path=value".
Value withSetting(const Value& root, const std::string& dottedPath, const std::string& valueText,
                  const std::string& origin = "");

/// A copy of an object without these members. The other values keep their places.
Value without(const Value& object, const std::vector<std::string>& names);

/// Collects messages, so that one run reports all errors of a file.
class Errors {
 public:
  void add(const Value& at, const std::string& message);
  void add(const std::vector<std::string>& messages);
  /// Runs `body` and adds the input error that it throws, if any.
  void collect(const std::function<void()>& body);
  bool any() const { return !lines_.empty(); }
  /// Throws UsageError with one message per line: the first 20, and the number of further ones.
  void throwIfAny() const;

 private:
  void addLine(const std::string& line);
  std::vector<std::string> lines_;
  std::set<std::string> known_;  ///< an error in a value that is used twice is reported once
};

// ---- Schemas: one table yields parsing, ranges, defaults, help, JSON Schema and docs ----

enum class FieldType { Bool, Integer, Number, String, Vec3, Numbers, Array, Object, Any };

struct Schema;

struct Field {
  std::string name{};
  FieldType type = FieldType::Any;
  std::string help{};         ///< one line, with the unit
  std::string defaultText{};  ///< JSON text; empty: no default (the field is required or optional,
                              ///< see below)
  bool required = false;
  std::optional<double> minimum{};  ///< of a number, of each item of Numbers, or of an Array's size
  std::optional<double> maximum{};
  std::vector<std::string> allowed{};  ///< allowed strings, or allowed items of an Array of strings
  const Schema* object = nullptr;      ///< members of an Object, or items of an Array of objects
  FieldType items = FieldType::Any;    ///< type of an Array's items
  std::string trade{};  ///< values that trade accuracy for time, for `tune`: "0,0.75,3"
};

struct Schema {
  std::string name{};
  std::string help{};
  std::vector<Field> fields{};
  bool open = false;  ///< other keys are allowed (a map from names)
};

/// Checks `value` against `schema`. Returns all errors, one line each, with the place, the value,
/// what is allowed, and the nearest name for unknown keys. Empty: `value` is valid.
std::vector<std::string> check(const Value& value, const Schema& schema);
/// Throws UsageError with all lines of check(), if any.
void require(const Value& value, const Schema& schema);
/// The value of a field or its default.
Value valueOr(const Value& object, const Schema& schema, const std::string& field);

/// Canonical JSON text of a checked object, with the defaults of all absent fields.
std::string withDefaults(const Value& object, const Schema& schema);

std::string jsonSchema(const Schema& schema);  ///< text of a JSON Schema, draft 2020-12

}  // namespace catoptric::config
