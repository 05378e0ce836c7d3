// The command line as data: what each command is called, and the table of its options, which ties
// every option to the member that keeps its value. command_line.cpp reads arguments by these
// tables, manual.cpp makes the manual page and the completion of them.
//
//   Command mergeCommand(CommonOptions& common) {
//     const auto o = std::make_shared<MergeOptions>();
//     const Rows own = {
//         option("runs", o->runs, "RUN", "The folders of the parts", {.required = true}),
//         option("--out", o->out, "DIR", "Folder for the whole run", {.notEmpty = true}),
//         flag("--dry-run", o->dryRun, "Write nothing"),
//     };
//     return {"merge", "Join the parts of a run into one run.", own + commonRows(common),
//             "Example:\n ...", [o, &common] { return merge(*o, common); }};
//   }
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "core/error.h"

namespace catoptric::app {

/// What holds of an option's values.
struct Rules {
  bool required = false;
  bool notEmpty = false;             ///< an empty value would mean something else
  std::optional<double> least = {};  ///< of a number; alone it can only be 0
  std::optional<double> most = {};   ///< of a number, inclusive; the help text says so
  bool showsDefault = false;         ///< behind the help text, in brackets
  bool commas = false;               ///< commas separate the values of a list
  bool oneEach = false;              ///< of a list: one argument each time the option is given
  const char* needs = nullptr;       ///< the option without which this one is refused
  bool* given = nullptr;             ///< becomes whether the option is on the command line
};

/// Where values are kept. A flag with an int counts how often it is given.
using Target = std::variant<bool*, int*, float*, double*, std::optional<double>*, std::string*,
                            std::vector<int>*, std::vector<std::string>*>;

/// An option ("--out", "-q,--quiet"), or an argument ("run") that has no dashes.
struct OptionRow {
  std::string spelling;
  Target member;
  std::string valueName;  ///< in the help; empty: a flag
  std::string help;
  Rules rules;

  bool isFlag() const { return valueName.empty(); }
  bool isArgument() const { return !spelling.starts_with('-'); }
  bool isList() const;
  /// "-q", "--quiet"; none of an argument.
  std::vector<std::string> names() const;
  /// "8"; "" where the rules do not show it.
  std::string defaultText() const;
};

OptionRow option(const char* spelling, Target member, const char* valueName, std::string help,
                 const Rules& rules = {});
template <class T>
OptionRow option(const char* spelling, T& member, const char* valueName, std::string help,
                 const Rules& rules = {}) {
  return option(spelling, Target(&member), valueName, std::move(help), rules);
}
template <class T>
OptionRow flag(const char* spelling, T& member, std::string help) {
  return option(spelling, Target(&member), "", std::move(help));
}

using Rows = std::vector<OptionRow>;
Rows operator+(Rows first, const Rows& then);

struct Command {
  std::string name;
  std::string summary;
  Rows options;
  std::string footer;             ///< of the help page: examples, exit codes
  std::function<ExitCode()> run;  ///< when the options have their values
  bool hidden = false;            ///< not for people
};

struct Program {
  std::string summary;
  std::string footer;
  std::vector<Command> commands;

  const Command& command(std::string_view name) const;
};

/// What every command has before its own options.
inline constexpr const char* kHelpNames = "-h,--help";
inline constexpr const char* kHelpText = "Print this help";

}  // namespace catoptric::app
