// JSON with places: every value knows the line it stands on and its JSON pointer, so that every
// message about input can name them. Parsing is by nlohmann::json; duplicate keys, NaN, comments,
// zero bytes and excessive depth are errors.
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

/// Where a value stands.
struct Place {
  std::string file;
  int line = 0;         ///< 1-based; 0: not from a file (a --set option)
  std::string pointer;  ///< "/objects/3/material"
  /// "scenes/room.json:12: /objects/3/material"
  std::string text() const;
};

/// A parsed JSON value. Cheap to copy (shared, immutable).
class Value {
 public:
  enum class Kind { Null, Bool, Number, String, Array, Object };

  Value();  ///< null
  Kind kind() const;
  const Place& place() const;

  // Typed access; a wrong kind is a UsageError that names the place, the value and what is wanted.
  bool asBool() const;
  double asNumber() const;
  std::int64_t asInteger() const;  ///< a number without fraction
  /// Where a number's text stands in what was parsed, as bytes from first to before second.
  std::pair<std::size_t, std::size_t> textRange() const;
  const std::string& asString() const;
  const std::vector<Value>& asArray() const;
  Vec3 asVec3() const;  ///< array of 3 finite numbers
  std::vector<float> asFloats(std::size_t count) const;

  bool isNull() const { return kind() == Kind::Null; }
  bool has(const std::string& key) const;
  /// Member of an object; null value (with the place of the object) when absent.
  Value get(const std::string& key) const;
  std::vector<std::string> keys() const;    ///< in the order of the file
  std::string dump(int indent = -1) const;  ///< canonical JSON text

  /// UsageError "place: message".
  [[noreturn]] void fail(const std::string& message) const;

  struct Node;  // config/node.h, for this module's sources
  explicit Value(std::shared_ptr<const Node> node);
  const Node& node() const { return *node_; }

 private:
  std::shared_ptr<const Node> node_;
};

/// Parses a file or text. Throws UsageError with file, line, column and reason.
Value parseFile(const std::filesystem::path& file);
Value parseText(const std::string& text, const std::string& name);

/// A copy of `root` with the value at dotted path "a.b" (array members by number: "methods.0.bvh")
/// replaced or added; `valueText` is parsed as JSON, and taken as a string when that fails.
/// `origin` stands for the file in messages; empty: "--set path=value".
Value withSetting(const Value& root, const std::string& dottedPath, const std::string& valueText,
                  const std::string& origin = "");

/// A copy of an object without these members; all else keeps its place.
Value without(const Value& object, const std::vector<std::string>& names);

/// Collects messages, so that one run of the program shows all of a file's errors.
class Errors {
 public:
  void add(const Value& at, const std::string& message);
  void add(const std::vector<std::string>& messages);
  /// Runs `body` and adds the error of input that it throws, if any.
  void collect(const std::function<void()>& body);
  bool any() const { return !lines_.empty(); }
  /// Throws UsageError with the messages, a line each: the first 20, and how many more there are.
  void throwIfAny() const;

 private:
  void addLine(const std::string& line);
  std::vector<std::string> lines_;
  std::set<std::string> known_;  ///< what is used twice is wrong once
};

// ---- Schemas: one table gives parsing, ranges, defaults, help, JSON Schema and docs ----

enum class FieldType { Bool, Integer, Number, String, Vec3, Numbers, Array, Object, Any };

struct Schema;

struct Field {
  std::string name{};
  FieldType type = FieldType::Any;
  std::string help{};         ///< one line; unit included
  std::string defaultText{};  ///< JSON text; empty: no default (required or optional below)
  bool required = false;
  std::optional<double> minimum{};  ///< of a number, of each of Numbers, of an Array's size
  std::optional<double> maximum{};
  std::vector<std::string> allowed{};  ///< strings, or items of an Array of strings
  const Schema* object = nullptr;      ///< members of an Object, or items of an Array of objects
  FieldType items = FieldType::Any;    ///< type of an Array's items
  std::string trade{};  ///< values to try where accuracy is traded for time: "0,0.75,3"
};

struct Schema {
  std::string name{};
  std::string help{};
  std::vector<Field> fields{};
  bool open = false;  ///< other keys are allowed (a map of names)
};

/// Checks `value` against `schema`; all errors of the value are collected, one line each, with
/// place, value, what is allowed, and the nearest name for unknown keys. Empty: valid.
std::vector<std::string> check(const Value& value, const Schema& schema);
/// Throws UsageError with all lines of check(), if any.
void require(const Value& value, const Schema& schema);
/// The value of a field or its default.
Value valueOr(const Value& object, const Schema& schema, const std::string& field);

/// Canonical JSON text of a checked object with the defaults of all absent fields filled in.
std::string withDefaults(const Value& object, const Schema& schema);

std::string jsonSchema(const Schema& schema);  ///< JSON Schema draft 2020-12 text

}  // namespace catoptric::config
