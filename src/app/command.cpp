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
  return joined(values, ",");
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

std::string OptionRow::fullHelp() const {
  if (!rules.showsDefault) return help;
  return std::visit(
      [&](const auto* value) -> std::string {
        if constexpr (requires { text(*value); })
          return help + " [" + text(*value) + "]";
        else
          return help;
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

std::string wrapped(const std::string& text, std::size_t width) {
  std::istringstream words(text);
  std::string lines;
  std::size_t column = 0;
  for (std::string word; words >> word;) {
    const bool breaks = column > 0 && column + 1 + word.size() > width;
    if (column > 0) lines += breaks ? "\n" : " ";
    column = (breaks || column == 0 ? 0 : column + 1) + word.size();
    lines += word;
  }
  return lines;
}

}  // namespace catoptric::app
