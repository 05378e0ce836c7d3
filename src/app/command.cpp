#include "app/command.h"

#include <algorithm>
#include <cassert>
#include <sstream>
#include <type_traits>

#include "core/text.h"

namespace catoptric::app {
namespace {

std::string text(const std::string& value) {
  return value;
}
std::string text(const std::vector<std::string>& values) {
  return "[" + joined(values, ",") + "]";
}
template <class T>
requires std::is_arithmetic_v<T> std::string text(T value) {
  std::ostringstream stream;
  stream << value;
  return stream.str();
}

}  // namespace

OptionRow option(const char* spelling, Target member, const char* valueName, std::string help,
                 const Rules& rules) {
  return {spelling, member, valueName, std::move(help), rules};
}

bool OptionRow::isList() const {
  return std::holds_alternative<std::vector<int>*>(member) ||
         std::holds_alternative<std::vector<std::string>*>(member);
}

std::vector<std::string> OptionRow::names() const {
  std::vector<std::string> names;
  if (isArgument()) return names;
  std::istringstream parts(spelling);
  for (std::string name; std::getline(parts, name, ',');) names.push_back(name);
  return names;
}

std::string OptionRow::defaultText() const {
  if (!rules.showsDefault) return "";
  return std::visit(
      [](const auto* value) -> std::string {
        if constexpr (requires { text(*value); })
          return text(*value);
        else
          return "";
      },
      member);
}

Rows operator+(Rows first, const Rows& then) {
  first.insert(first.end(), then.begin(), then.end());
  return first;
}

const Command& Program::command(std::string_view name) const {
  const auto found = std::find_if(commands.begin(), commands.end(),
                                  [&](const Command& command) { return command.name == name; });
  assert(found != commands.end());
  return *found;
}

}  // namespace catoptric::app
