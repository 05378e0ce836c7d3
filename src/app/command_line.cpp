// The only file that knows CLI11: it reads arguments by the tables of the commands.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <sstream>

#include "app/commands.h"
#include "core/log.h"
#include "core/text.h"
#include "gl/shader.h"
#include "run/folder/machine.h"

namespace catoptric::app {
namespace {

constexpr std::size_t kNameWidth = 34;  ///< columns of the options' names

/// CLI11's help pages, with the descriptions in lines that a terminal holds.
class HelpFormatter : public CLI::Formatter {
 public:
  HelpFormatter() { column_width(kNameWidth); }
  std::string make_group(std::string group, bool isPositional,
                         std::vector<const CLI::Option*> options) const override {
    const bool anyDefault = std::ranges::any_of(options, [](const CLI::Option* option) {
      return option->get_description().ends_with("]");
    });
    if (anyDefault) group += " (defaults in [ ])";
    return CLI::Formatter::make_group(group, isPositional, options);
  }
  std::string make_option_desc(const CLI::Option* option) const override {
    return wrapped(CLI::Formatter::make_option_desc(option), kHelpWidth - kNameWidth);
  }
  std::string make_subcommand(const CLI::App* command) const override {
    std::ostringstream text;
    CLI::detail::format_help(text, command->get_name(),
                             wrapped(command->get_description(), kHelpWidth - kNameWidth),
                             kNameWidth);
    return text.str();
  }
  std::string make_description(const CLI::App* app) const override {
    return wrapped(app->get_description(), kHelpWidth) + "\n";
  }
  std::string make_footer(const CLI::App* app) const override { return "\n" + app->get_footer(); }
};

/// The option's validators, with no description: the help text says what is allowed.
void addChecks(CLI::Option& option, const Rules& rules) {
  if (rules.notEmpty)
    option.check(
        {[](const std::string& text) { return text.empty() ? "must not be empty" : ""; }, ""});
  if (rules.most)
    option.check(CLI::Range(rules.least.value(), *rules.most).description(""));
  else if (rules.least)
    option.check(CLI::Validator(CLI::NonNegativeNumber).description(""));
  if (rules.least)  // comparisons let it through
    option.check({[](const std::string& text) {
                    return std::isnan(std::strtod(text.c_str(), nullptr)) ? "must be a number" : "";
                  },
                  ""});
}

void addOption(CLI::App& command, const OptionRow& row) {
  CLI::Option* option = std::visit(
      [&](auto* member) -> CLI::Option* {
        using Member = std::remove_pointer_t<decltype(member)>;
        if constexpr (std::is_same_v<Member, bool>) {
          return command.add_flag(row.spelling, *member, row.help);
        } else {
          if constexpr (std::is_same_v<Member, int>)
            if (row.isFlag()) return command.add_flag(row.spelling, *member, row.help);
          return command.add_option(row.spelling, *member, row.fullHelp());
        }
      },
      row.member);
  if (row.isFlag()) return;
  const Rules& rules = row.rules;
  addChecks(*option, rules);
  option->type_name(row.valueName)->required(rules.required);
  if (rules.commas) option->delimiter(',');
  if (rules.oneEach) option->allow_extra_args(false);
  if (rules.needs != nullptr) option->needs(command.get_option(rules.needs));
}

/// The parser of a program; `chosen` becomes the command of the arguments.
std::unique_ptr<CLI::App> makeParser(const Program& program, const Command*& chosen) {
  auto parser = std::make_unique<CLI::App>(program.summary, "catoptric");
  parser->formatter(std::make_shared<HelpFormatter>());
  parser->set_version_flag("--version", std::string("catoptric ") + run::versionText(),
                           "Print the program's version");
  parser->set_help_flag(kHelpNames, kHelpText);
  parser->require_subcommand(1);
  for (const Command& command : program.commands) {
    CLI::App* one = parser->add_subcommand(command.name, command.summary);
    if (command.hidden) one->group("");
    for (const OptionRow& row : command.options) addOption(*one, row);
    one->footer(command.footer);
    one->callback([&chosen, &command, one] {
      chosen = &command;
      for (const OptionRow& row : command.options)
        if (row.rules.given != nullptr) *row.rules.given = one->count(row.spelling) > 0;
    });
  }
  parser->footer(program.footer);  // last: commands would inherit it
  return parser;
}

/// The options' names of a command, with their dashes.
std::vector<std::string> optionNames(const CLI::App& command) {
  std::vector<std::string> names;
  for (const CLI::Option* option : command.get_options())
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  return names;
}

/// " (did you mean ...?)": the nearest name, or a name of which one is the other's beginning.
std::string nearestOption(const std::string& name, const std::vector<std::string>& known) {
  if (std::string near = didYouMean(name, known); !near.empty()) return near;
  constexpr std::size_t kLeast = 5;  // "--out"; ours
  for (const std::string& option : known)
    if (std::min(option.size(), name.size()) >= kLeast &&
        (name.starts_with(option) || option.starts_with(name)))
      return " (did you mean \"" + option + "\"?)";
  return "";
}

/// CLI11's complaint, with the nearest name of what it does not know.
std::string parseMessage(const CLI::App& parser, const CLI::ParseError& error,
                         const std::vector<std::string>& arguments) {
  std::string message = error.what();
  std::vector<std::string> known = optionNames(parser);
  std::string command;
  for (const CLI::App* chosen : parser.get_subcommands()) {
    command = " " + chosen->get_name();
    known = optionNames(*chosen);
  }
  if (error.get_exit_code() == static_cast<int>(CLI::ExitCodes::ExtrasError)) {
    for (const std::string& argument : arguments) {
      const std::string name = argument.substr(0, argument.find('='));
      if (name.starts_with("--") && std::find(known.begin(), known.end(), name) == known.end())
        message = "unknown option " + name + nearestOption(name, known);
    }
  }
  return message + "\nSee: catoptric" + command + " --help";
}

}  // namespace

ExitCode runProgram(std::vector<std::string> arguments) {
  CommonOptions common;
  const Program program = makeProgram(common);
  const Command* chosen = nullptr;
  const std::unique_ptr<CLI::App> parser = makeParser(program, chosen);
  if (!arguments.empty() && arguments[0] == "help") {  // "help render" is "render --help"
    arguments.erase(arguments.begin());
    arguments.push_back("--help");
  }
  if (arguments.empty()) {
    std::fputs(parser->help().c_str(), stderr);
    return ExitCode::Usage;
  }
  std::vector<std::string> names;
  for (const Command& command : program.commands)
    if (!command.hidden) names.push_back(command.name);
  if (!arguments[0].starts_with("-") && arguments[0] != "worker" &&
      std::find(names.begin(), names.end(), arguments[0]) == names.end())
    throw UsageError("unknown command \"" + arguments[0] + "\"" + didYouMean(arguments[0], names) +
                     "; commands: " + joined(names, ", "));
  try {
    // The last one first, as CLI11 takes them
    parser->parse(std::vector<std::string>(arguments.rbegin(), arguments.rend()));
  } catch (const CLI::CallForHelp&) {
    const auto commands = parser->get_subcommands();
    printData(commands.empty() ? parser->help() : commands.front()->help("catoptric"));
    return ExitCode::Done;
  } catch (const CLI::CallForVersion& version) {
    printData(std::string(version.what()) + "\n");
    return ExitCode::Done;
  } catch (const CLI::ParseError& error) {
    throw UsageError(parseMessage(*parser, error, arguments));
  }
  log::setLevel(common.quiet         ? log::Level::Warning
                : common.verbose > 0 ? log::Level::Debug
                                     : log::Level::Info);
  if (!common.shaderFolder.empty()) gl::setShaderFolder(common.shaderFolder);
  return chosen->run();
}

}  // namespace catoptric::app
