// The command line as data: the name of each command, and the table of its options, which connects
// every option with the member that stores its value. command_line.cpp parses arguments with these
// tables; manual.cpp generates the manual page and the shell completion from them.
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

/// The constraints on an option's values.
struct Rules {
  bool required = false;
  bool notEmpty = false;             ///< the value must not be empty
  std::optional<double> least = {};  ///< minimum of a number; must be 0 if there is no `most`
  std::optional<double> most = {};   ///< maximum of a number, inclusive; the help text states it
  bool showsDefault = false;         ///< the help text ends with the default in brackets
  bool commas = false;               ///< commas separate the values of a list
  bool oneEach = false;              ///< for a list: takes one value each time the option is given
  const char* needs = nullptr;       ///< the option that must be given together with this one
  bool* given = nullptr;             ///< set to whether the option is on the command line
};

/// The members that store values. A flag with an int counts how often it is given.
using Target = std::variant<bool*, int*, float*, double*, std::optional<double>*, std::string*,
                            std::vector<int>*, std::vector<std::string>*>;

/// An option ("--out", "-q,--quiet"), or an argument ("run"), which has no dashes.
struct OptionRow {
  std::string spelling;
  Target member;
  std::string valueName;  ///< shown in the help; empty: the option is a flag
  std::string help;
  Rules rules;

  bool isFlag() const { return valueName.empty(); }
  bool isArgument() const { return !spelling.starts_with('-'); }
  bool isList() const;
  /// "-q", "--quiet"; empty for an argument.
  std::vector<std::string> names() const;
  /// The help text, which ends with the default in brackets if the rules show it.
  std::string fullHelp() const;
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
  std::string footer;             ///< end of the help page: examples, exit codes
  std::function<ExitCode()> run;  ///< called when the options have their values
  bool hidden = false;            ///< not listed in the help
};

struct Program {
  std::string summary;
  std::string footer;
  std::vector<Command> commands;

  const Command& command(std::string_view name) const;
};

inline constexpr std::size_t kHelpWidth = 100;  ///< columns of a help page
/// `text` in lines of at most `width` columns.
std::string wrapped(const std::string& text, std::size_t width);

/// The help option that every command has before its own options.
inline constexpr const char* kHelpNames = "-h,--help";
inline constexpr const char* kHelpText = "Print this help";

}  // namespace catoptric::app
