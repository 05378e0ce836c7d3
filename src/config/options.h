// Binds options once: a table connects each member of a plain struct with its name in JSON, its
// range and its help. The default is the struct's own initialiser. The table yields the schema
// (checks, JSON Schema, docs) and the parsing.
//
//   enum class Policy { Static, Refit };
//   struct Options {
//     int rays = 8;
//     Policy bvh = Policy::Static;
//   };
//   constexpr auto kPolicies =
//       config::names<Policy>({{"static", Policy::Static}, {"refit", Policy::Refit}});
//
//   const config::OptionTable<Options>& optionTable() {
//     static const config::OptionTable<Options> table(
//         "traced", "Options of the method traced.",
//         {field(&Options::rays, "rays", config::range(1, 64), "rays per sample"),
//          field(&Options::bvh, "bvh", kPolicies, "how the BVH follows the geometry")});
//     return table;
//   }
//
//   optionTable().schema();      // for MethodEntry::options
//   optionTable().parse(value);  // an Options; UsageError with all errors of the value
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "config/json.h"
#include "config/json_text.h"

namespace catoptric::config {

// ---- The values that a field may have ----

/// The minimum and maximum of a number, both inclusive.
struct Range {
  std::optional<double> least;
  std::optional<double> most;
};
constexpr Range range(double least, double most) {
  return {least, most};
}
constexpr Range atLeast(double least) {
  return {least, {}};
}

/// The JSON names of the values of an enumeration (or of false and true).
template <class T>
struct NamedValue {
  const char* name;
  T value;
};

template <class T, std::size_t N>
struct Names {
  std::array<NamedValue<T>, N> values;

  /// The name of `value`, which must have one.
  constexpr const char* of(T value) const {
    const auto entry = std::find_if(values.begin(), values.end(),
                                    [&](const NamedValue<T>& e) { return e.value == value; });
    assert(entry != values.end());
    return entry->name;
  }
  /// The value called `name`, which must be one of the names (the schema has been checked before).
  constexpr T value(std::string_view name) const {
    const auto entry = std::find_if(values.begin(), values.end(),
                                    [&](const NamedValue<T>& e) { return e.name == name; });
    assert(entry != values.end());
    return entry->value;
  }
  std::vector<std::string> all() const {
    std::vector<std::string> list;
    for (const NamedValue<T>& entry : values) list.emplace_back(entry.name);
    return list;
  }
};

template <class T, std::size_t N>
constexpr Names<T, N> names(const NamedValue<T> (&values)[N]) {
  Names<T, N> result{};
  std::copy(values, values + N, result.values.begin());
  return result;
}

/// The strings that may occur in an array of strings.
struct AllowedItems {
  std::vector<std::string> names;
};

// ---- The member that stores the value ----

/// A member of a nested struct: in(&Options::path, &PathOptions::order).
template <class Outer, class Inner, class T>
struct NestedMember {
  Inner Outer::*outer;
  T Inner::*inner;
};
template <class Outer, class Inner, class T>
constexpr NestedMember<Outer, Inner, T> in(Inner Outer::*outer, T Inner::*inner) {
  return {outer, inner};
}

/// One member of the JSON object: its description, and a function that reads its value (or the
/// default, if absent) into the struct. For members that field() cannot bind, write an Option by
/// hand.
template <class Options>
struct Option {
  Field description;
  std::function<void(Options&, const Value&)> read;

  /// Marks the option as one that trades accuracy for time. `tune` tries these values: "0,0.75,3".
  Option trade(std::string values) && {
    description.help += "; `tune` tries " + values;
    description.trade = std::move(values);
    return std::move(*this);
  }
};

namespace detail {

template <class Options, class T>
T& access(Options& options, T Options::*member) {
  return options.*member;
}
template <class Outer, class Inner, class T>
T& access(Outer& options, const NestedMember<Outer, Inner, T>& member) {
  return options.*(member.outer).*(member.inner);
}

/// Determines the struct and the member's type from a pointer to member or a NestedMember.
template <class Options, class T>
struct Bound {
  using Struct = Options;
  using Type = T;
};
template <class Options, class T>
Bound<Options, T> boundBy(T Options::*);
template <class Outer, class Inner, class T>
Bound<Outer, T> boundBy(NestedMember<Outer, Inner, T>);
template <class Member>
using StructOf = typename decltype(boundBy(std::declval<Member>()))::Struct;
template <class Member>
using TypeOf = typename decltype(boundBy(std::declval<Member>()))::Type;

/// The default as a person would write it: 8 (also for a float), 0.75, "text", true or [].
template <class T>
std::string defaultText(const T& value) {
  if constexpr (std::is_same_v<T, bool>) {
    return value ? "true" : "false";
  } else if constexpr (std::is_integral_v<T>) {
    return std::to_string(value);
  } else if constexpr (std::is_floating_point_v<T>) {
    const bool isWhole = std::trunc(value) == value && std::abs(value) < T(1e15);
    return isWhole ? std::to_string(static_cast<long long>(value)) : numberText(value);
  } else if constexpr (std::is_same_v<T, std::string>) {
    return jsonString(value);
  } else {
    static_assert(std::is_same_v<T, std::vector<std::string>>, "write the Option out");
    std::string text;
    for (const std::string& item : value) text += (text.empty() ? "" : ",") + jsonString(item);
    return "[" + text + "]";
  }
}

template <class T>
constexpr FieldType fieldType() {
  if (std::is_same_v<T, bool>) return FieldType::Bool;
  if (std::is_integral_v<T>) return FieldType::Integer;
  if (std::is_floating_point_v<T>) return FieldType::Number;
  if (std::is_same_v<T, std::string>) return FieldType::String;
  return FieldType::Array;
}

template <class T>
T valueOf(const Value& value) {
  if constexpr (std::is_same_v<T, bool>) {
    return value.asBool();
  } else if constexpr (std::is_integral_v<T>) {
    return static_cast<T>(value.asInteger());
  } else if constexpr (std::is_floating_point_v<T>) {
    return static_cast<T>(value.asNumber());
  } else if constexpr (std::is_same_v<T, std::string>) {
    return value.asString();
  } else {
    T list;
    for (const Value& item : value.asArray()) list.push_back(item.asString());
    return list;
  }
}

}  // namespace detail

/// Binds a bool, a number, a string or an array of strings.
template <class Member>
Option<detail::StructOf<Member>> field(Member member, std::string name, std::string help) {
  using Options = detail::StructOf<Member>;
  using T = detail::TypeOf<Member>;
  Options defaults{};
  Field description;
  description.name = std::move(name);
  description.type = detail::fieldType<T>();
  description.help = std::move(help);
  description.defaultText = detail::defaultText(detail::access(defaults, member));
  if (description.type == FieldType::Array) description.items = FieldType::String;
  return {std::move(description), [member](Options& options, const Value& value) {
            detail::access(options, member) = detail::valueOf<T>(value);
          }};
}

/// Binds a number within a range.
template <class Member>
Option<detail::StructOf<Member>> field(Member member, std::string name, Range range,
                                       std::string help) {
  auto option = field(member, std::move(name), std::move(help));
  option.description.minimum = range.least;
  option.description.maximum = range.most;
  return option;
}

/// Binds a number of bytes that is given in MiB.
template <class Member>
Option<detail::StructOf<Member>> mebibytes(Member member, std::string name, std::string help) {
  using Options = detail::StructOf<Member>;
  auto option = field(member, std::move(name), Range{1, 65536}, std::move(help));
  Options defaults{};
  option.description.defaultText = std::to_string(detail::access(defaults, member) >> 20);
  option.read = [member](Options& options, const Value& value) {
    detail::access(options, member) = static_cast<std::uint64_t>(value.asInteger()) << 20;
  };
  return option;
}

/// Binds an array whose strings come from a given set.
template <class Member>
Option<detail::StructOf<Member>> field(Member member, std::string name, const AllowedItems& items,
                                       std::string help) {
  auto option = field(member, std::move(name), std::move(help));
  option.description.allowed = items.names;
  return option;
}

/// Binds one of several names, each of which stands for a value of the member's type.
template <class Member, class T, std::size_t N>
Option<detail::StructOf<Member>> field(Member member, std::string name, const Names<T, N>& names,
                                       std::string help) {
  using Options = detail::StructOf<Member>;
  static_assert(std::is_same_v<T, detail::TypeOf<Member>>);
  Options defaults{};
  Field description;
  description.name = std::move(name);
  description.type = FieldType::String;
  description.help = std::move(help);
  description.defaultText = jsonString(names.of(detail::access(defaults, member)));
  description.allowed = names.all();
  return {std::move(description), [member, names](Options& options, const Value& value) {
            detail::access(options, member) = names.value(value.asString());
          }};
}

/// All options of one JSON object, bound to `Options`.
template <class Options>
class OptionTable {
 public:
  OptionTable(std::string name, std::string help, std::vector<Option<Options>> options)
      : options_(std::move(options)) {
    schema_.name = std::move(name);
    schema_.help = std::move(help);
    for (const Option<Options>& option : options_) schema_.fields.push_back(option.description);
  }

  const Schema& schema() const { return schema_; }

  /// Checks `value` and reads it; absent members get their defaults. Throws UsageError.
  Options parse(const Value& value) const {
    require(value, schema_);
    Options options{};
    read(options, value);
    return options;
  }

  /// Reads a checked value into members of `options`.
  void read(Options& options, const Value& value) const {
    for (const Option<Options>& option : options_)
      option.read(options, valueOr(value, schema_, option.description.name));
  }

 private:
  std::vector<Option<Options>> options_;
  Schema schema_;
};

/// Binds a member that is itself an object with options. They are stored in the same struct.
/// `table` must outlive the result.
template <class Options>
Option<Options> group(std::string name, const OptionTable<Options>& table, std::string help) {
  Field description;
  description.name = std::move(name);
  description.type = FieldType::Object;
  description.help = std::move(help);
  description.object = &table.schema();
  return {std::move(description),
          [&table](Options& options, const Value& value) { table.read(options, value); }};
}

}  // namespace catoptric::config
