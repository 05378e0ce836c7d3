// The members that each object of a glTF file may have, with their types and ranges; private to
// this folder.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "config/json.h"
#include "scene/gltf/container.h"

namespace catoptric::scene::gltf {

enum class Kind { Bool, Integer, Number, String, Numbers, Indices, IndexMap, Object, Array };

struct Table;

struct Rule {
  std::string_view key;
  Kind kind = Kind::Number;
  bool required = false;
  const Table* table = nullptr;  ///< members of an Object, or of each item of an Array
  std::string_view refers = {};  ///< the value is an index into this root array
  double minimum = -1e18;
  double maximum = 1e18;
  std::vector<double> allowed = {};
  std::vector<std::string> words = {};
  std::size_t size = 0;  ///< exact length of Numbers
  bool nonEmpty = false;
};

struct Table {
  std::vector<Rule> rules;
};

/// The rule for an object whose members are indices of accessors.
Rule accessorMap(std::string_view key, bool required);

/// The members of "extras": {"catoptric": ...} of nodes and materials.
const Table& ownExtras();

/// A number with up to 9 digits, for messages.
std::string formatted(double value);
/// The text in quotes, shortened if long.
std::string quoted(const std::string& value);

/// Checks values against rules. The first violation throws SceneError with its JSON pointer.
class Checker {
 public:
  /// All arguments must outlive the checker. `root` was parsed from `json`. `rewrites` receives the
  /// numbers in it that tinygltf would misread.
  Checker(const config::Value& root, std::string_view json, const std::string& file,
          std::vector<Rewrite>& rewrites)
      : root_(root), json_(json), file_(file), rewrites_(rewrites) {}

  /// Checks the whole file.
  void checkRoot() const;
  void checkObject(const config::Value& value, const Table& table, const std::string& place) const;
  void checkIndexMap(const config::Value& value, const Rule& rule, const std::string& place) const;
  void require(const config::Value& value, config::Value::Kind kind,
               const std::string& place) const;
  /// The number of elements of a root array.
  std::size_t countOf(std::string_view array) const;
  [[noreturn]] void failAt(const std::string& place, const std::string& message) const;

 private:
  void checkMember(const config::Value& value, const Rule& rule, const std::string& place) const;
  void checkString(const config::Value& value, const Rule& rule, const std::string& place) const;
  void checkNumber(const config::Value& value, const Rule& rule, const std::string& place) const;
  void checkInteger(const config::Value& value, const Rule& rule, const std::string& place) const;
  void checkWholeNumber(double x, const Rule& rule, const std::string& place) const;
  /// Adds a rewrite of the number to `text`, unless it is written so already.
  void rewrite(const config::Value& value, std::string text) const;
  /// The items of an array, which must not be empty if the rule says so.
  const std::vector<config::Value>& items(const config::Value& value, const Rule& rule,
                                          const std::string& place) const;

  const config::Value& root_;
  std::string_view json_;
  const std::string& file_;
  std::vector<Rewrite>& rewrites_;
};

}  // namespace catoptric::scene::gltf
