// The program's options and help, and which command is run.
#include "app/commands.h"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <memory>
#include <sstream>

#include "core/log.h"
#include "core/text.h"
#include "gl/shader.h"
#include "run/folder/machine.h"

namespace catoptric::app {
namespace {

constexpr const char* kFooter = R"(Examples:
  catoptric render configs/demo.json --out out/demo
  catoptric render scenes/cornell_box.json --method traced --set image.width=256
  catoptric render configs/demo.json --out out/demo --existing resume
  catoptric merge out/part1 out/part2 --out out/whole
  catoptric submit configs/demo.json --chunks 20 --out out/shared
  catoptric plan configs/demo.json
  catoptric info scenes/living_room.json
  catoptric compare out/demo/traced out/demo/reference
  catoptric layers out/demo/second_order --layer mask --out out/pictures
  catoptric sweep configs/demo.json --vary methods.second_order.level_error=0,0.75

Exit codes:
  0  everything is done
  2  the command line or a run config is wrong
  3  a scene or one of its files is missing or damaged
  4  no OpenGL device can be had; see `catoptric doctor`
  5  output could not be written, or a folder that is not empty stands in its way
  6  some frames failed
  7  a comparison exceeded its limits
  8  the memory did not suffice
  70 a fault of the program itself: please report it
  128 + N  the process was ended by signal N
)";

constexpr std::size_t kHelpWidth = 100;  ///< columns of a help page
constexpr std::size_t kNameWidth = 34;   ///< columns of the options' names

/// `text` in lines of at most `width` columns.
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

/// CLI11's help pages, with the descriptions in lines that a terminal holds.
class HelpFormatter : public CLI::Formatter {
 public:
  HelpFormatter() { column_width(kNameWidth); }
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

std::vector<std::string> commandNames(const CLI::App& program) {
  std::vector<std::string> names;
  for (const CLI::App* command :
       program.get_subcommands([](const CLI::App* one) { return !one->get_group().empty(); }))
    names.push_back(command->get_name());
  return names;
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
std::string parseMessage(const CLI::App& program, const CLI::ParseError& error,
                         const std::vector<std::string>& arguments) {
  std::string message = error.what();
  std::vector<std::string> known = optionNames(program);
  std::string command;
  for (const CLI::App* chosen : program.get_subcommands()) {
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

/// The program with its commands; the one that is chosen sets `action`.
std::unique_ptr<CLI::App> makeProgram(CommonOptions& common, Action& action) {
  auto program = std::make_unique<CLI::App>(
      "A headless batch renderer for reflections. It renders the frames of a camera path by one or "
      "several methods, and measures their times and errors.",
      "catoptric");
  program->formatter(std::make_shared<HelpFormatter>());
  program->set_version_flag("--version", std::string("catoptric ") + run::versionText(),
                            "Print the program's version");
  program->set_help_flag("-h,--help", "Print this help");
  program->require_subcommand(1);
  addRender(*program, common, action);
  addPlan(*program, common, action);
  addInfo(*program, common, action);
  addList(*program, common, action);
  addDoctor(*program, common, action);
  addMerge(*program, common, action);
  addSubmit(*program, common, action);
  addStatus(*program, common, action);
  addRetry(*program, common, action);
  addCancel(*program, common, action);
  addCompare(*program, common, action);
  addLayers(*program, common, action);
  addSweep(*program, common, action);
  addTables(*program, common, action);
  addTune(*program, common, action);
  addNightly(*program, common, action);
  addWorker(*program, common, action);
  program->footer(kFooter);  // last: commands would inherit it
  return program;
}

}  // namespace

ExitCode runProgram(std::vector<std::string> arguments) {
  CommonOptions common;
  Action action;
  const std::unique_ptr<CLI::App> program = makeProgram(common, action);
  if (!arguments.empty() && arguments[0] == "help") {  // "help render" is "render --help"
    arguments.erase(arguments.begin());
    arguments.push_back("--help");
  }
  if (arguments.empty()) {
    std::fputs(program->help().c_str(), stderr);
    return ExitCode::Usage;
  }
  const std::vector<std::string> names = commandNames(*program);
  if (!arguments[0].starts_with("-") && arguments[0] != "worker" &&
      std::find(names.begin(), names.end(), arguments[0]) == names.end())
    throw UsageError("unknown command \"" + arguments[0] + "\"" + didYouMean(arguments[0], names) +
                     "; commands: " + joined(names, ", "));
  try {
    // The last one first, as CLI11 takes them
    program->parse(std::vector<std::string>(arguments.rbegin(), arguments.rend()));
  } catch (const CLI::CallForHelp&) {
    const auto chosen = program->get_subcommands();
    printData(chosen.empty() ? program->help() : chosen.front()->help("catoptric"));
    return ExitCode::Done;
  } catch (const CLI::CallForVersion& version) {
    printData(std::string(version.what()) + "\n");
    return ExitCode::Done;
  } catch (const CLI::ParseError& error) {
    throw UsageError(parseMessage(*program, error, arguments));
  }
  log::setLevel(common.quiet         ? log::Level::Warning
                : common.verbose > 0 ? log::Level::Debug
                                     : log::Level::Info);
  if (!common.shaderFolder.empty()) gl::setShaderFolder(common.shaderFolder);
  return action();
}

void addCommon(CLI::App& command, CommonOptions& common) {
  command.add_flag("--json", common.json, "Print the data on stdout as JSON");
  command.add_flag("-q,--quiet", common.quiet, "Print only warnings and errors on stderr");
  command.add_flag("-v,--verbose", common.verbose, "Print details on stderr, too");
}

void printData(const std::string& text) {
  const std::string shown = printable(text);  // names of files and objects are not ours
  if (std::fwrite(shown.data(), 1, shown.size(), stdout) == shown.size() &&
      std::fflush(stdout) == 0)
    return;
  if (errno == EPIPE) throw ReaderGone();
  throw OutputError("stdout: cannot be written");
}

}  // namespace catoptric::app
