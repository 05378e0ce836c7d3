// catoptric's command line: subcommands, and errors as exit codes.
#include <CLI/CLI.hpp>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <exception>
#include <iostream>

#include "app/commands.h"
#include "core/log.h"
#include "core/text.h"
#include "gl/shader.h"
#include "run/folder/machine.h"

namespace catoptric::app {
namespace {

constexpr const char* kExamples = R"(
Examples:
  catoptric render configs/demo.json --out out/demo
  catoptric render scenes/cornell_box.json --method traced --set image.width=256
  catoptric render configs/demo.json --out out/demo --existing resume
  catoptric merge out/part1 out/part2 --out out/whole
  catoptric plan configs/demo.json
  catoptric info scenes/living_room.json
  catoptric compare out/demo/traced out/demo/reference
  catoptric layers out/demo/second_order --layer mask --out out/pictures

Exit codes: 0 done; 2 usage or config; 3 scene or asset; 4 no GL device; 5 output could not be
written; 6 some frames failed; 7 a comparison exceeded its limits; 128+n ended by signal n.
)";

/// What reads stdout has seen enough (`| head`): no error of ours.
struct ReaderGone {};

std::vector<std::string> commandNames(const CLI::App& program) {
  std::vector<std::string> names;
  for (const CLI::App* command : program.get_subcommands([](const CLI::App*) { return true; }))
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

int fail(const std::string& message, ExitCode code) {
  log::error(message);
  return static_cast<int>(code);
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
        message = "unknown option " + name + didYouMean(name, known);
    }
  }
  return message + "\nSee: catoptric" + command + " --help";
}

int runProgram(int argc, char** argv) {
  CLI::App program("Headless batch renderer for reflections.", "catoptric");
  program.footer(kExamples);
  program.set_version_flag("--version", std::string("catoptric ") + run::versionText());
  program.require_subcommand(1);
  program.get_formatter()->column_width(34);

  CommonOptions common;
  Action action;
  addRender(program, common, action);
  addPlan(program, common, action);
  addInfo(program, common, action);
  addList(program, common, action);
  addDoctor(program, common, action);
  addMerge(program, common, action);
  addCompare(program, common, action);
  addLayers(program, common, action);

  std::vector<std::string> arguments(argv + 1, argv + argc);
  if (!arguments.empty() && arguments[0] == "help") {  // "help render" is "render --help"
    arguments.erase(arguments.begin());
    arguments.push_back("--help");
  }
  const std::vector<std::string> names = commandNames(program);
  if (arguments.empty()) {
    std::cerr << program.help();
    return static_cast<int>(ExitCode::Usage);
  }
  if (!arguments[0].starts_with("-") &&
      std::find(names.begin(), names.end(), arguments[0]) == names.end())
    return fail("unknown command \"" + arguments[0] + "\"" + didYouMean(arguments[0], names) +
                    "; commands: " + joined(names, ", "),
                ExitCode::Usage);
  try {
    // The last one first, as CLI11 takes them
    program.parse(std::vector<std::string>(arguments.rbegin(), arguments.rend()));
  } catch (const CLI::CallForHelp&) {
    const auto chosen = program.get_subcommands();
    printData(chosen.empty() ? program.help() : chosen.front()->help("catoptric"));
    return 0;
  } catch (const CLI::CallForVersion& version) {
    printData(std::string(version.what()) + "\n");
    return 0;
  } catch (const CLI::ParseError& error) {
    return fail(parseMessage(program, error, arguments), ExitCode::Usage);
  }
  log::setLevel(common.quiet         ? log::Level::Warning
                : common.verbose > 0 ? log::Level::Debug
                                     : log::Level::Info);
  if (!common.shaderFolder.empty()) gl::setShaderFolder(common.shaderFolder);
  return static_cast<int>(action());
}

}  // namespace

void addCommon(CLI::App& command, CommonOptions& common) {
  command.add_flag("--json", common.json, "Data as JSON on stdout");
  command.add_flag("-q,--quiet", common.quiet, "Only warnings and errors on stderr");
  command.add_flag("-v,--verbose", common.verbose, "More on stderr");
  command
      .add_option("--shader-dir", common.shaderFolder,
                  "Read shaders from this copy of src/ instead of the program, while developing")
      ->type_name("DIR");
}

void printData(const std::string& text) {
  if (std::fwrite(text.data(), 1, text.size(), stdout) == text.size() && std::fflush(stdout) == 0)
    return;
  if (errno == EPIPE) throw ReaderGone();
  throw OutputError("stdout: cannot be written");
}

}  // namespace catoptric::app

int main(int argc, char** argv) {
  using namespace catoptric;
  // A closed pipe and a file size limit are errors of a write, not the end of the process.
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
  try {
    return app::runProgram(argc, argv);
  } catch (const Error& error) {
    return app::fail(error.what(), error.code());
  } catch (const app::ReaderGone&) {
    return 128 + SIGPIPE;
  } catch (const std::bad_alloc&) {
    return app::fail("out of memory", ExitCode::Internal);
  } catch (const std::exception& error) {
    return app::fail(std::string("internal error: ") + error.what(), ExitCode::Internal);
  }
}
