// The commands. Each is a table of options and a function that runs if the command is chosen.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "app/command.h"
#include "core/error.h"
#include "report/table.h"

namespace catoptric::app {

/// The options that every command has.
struct CommonOptions {
  bool json = false;
  bool quiet = false;
  int verbose = 0;
  std::string shaderFolder;
};

/// The options of commands that render or plan.
struct RunOptions {
  std::string input;
  std::string out;
  std::string frames;
  std::string camera;
  std::string environment;
  std::vector<std::string> assetPaths;
  std::string ground;
  std::vector<std::string> methods;
  std::vector<std::string> settings;
  std::string device;
  std::string threads;
  std::string seed;
};

Command renderCommand(CommonOptions& common);
Command planCommand(CommonOptions& common);
Command infoCommand(CommonOptions& common);
Command listCommand(CommonOptions& common);
Command doctorCommand(CommonOptions& common);
Command mergeCommand(CommonOptions& common);
Command submitCommand(CommonOptions& common);
/// Commands for submissions: status, retry, cancel.
Command statusCommand(CommonOptions& common);
Command retryCommand(CommonOptions& common);
Command cancelCommand(CommonOptions& common);
Command compareCommand(CommonOptions& common);
Command figureCommand(CommonOptions& common);
Command layersCommand(CommonOptions& common);
Command sweepCommand(CommonOptions& common);
Command tablesCommand(CommonOptions& common);
Command nightlyCommand(CommonOptions& common);
Command tuneCommand(CommonOptions& common);
Command workerCommand(CommonOptions& common);

/// All commands, in the order of the help page.
Program makeProgram(CommonOptions& common);

/// Reads the command line (without the program's name) and runs the command. Throws what the
/// command throws, and UsageError for arguments that cannot be parsed.
ExitCode runProgram(std::vector<std::string> arguments);

/// An exit code of a command, with the command's own text for it; null: the text that all commands
/// share.
struct ExitText {
  std::string_view code;
  const char* text = nullptr;
};
/// The lines of a help page that explain exit codes: "Exit codes: 0 done; ...". Code 0 is always
/// explained, so that `codes` need not contain "0".
std::string exitCodes(std::vector<ExitText> codes);

/// The rows of --existing and --progress, which several commands have.
OptionRow existingRow(std::string& how);
OptionRow progressRow(std::string& how);
/// The value of arguments that name frames.
inline constexpr const char* kFramesHelp = "A run's folder, a folder of EXR files, or one EXR file";

/// The rows of --json, -q and -v.
Rows commonRows(CommonOptions& common);
/// The rows of options that change the scene: --environment, --asset-path, --ground.
Rows sceneRows(RunOptions& options);
/// The rows of CONFIG|SCENE, --frames, --method, --set, --device, --threads, --seed, --shader-dir,
/// and the common options.
Rows runRows(RunOptions& options, CommonOptions& common);

/// Thrown if the process that reads stdout has closed it (`| head`). The program then just stops.
struct ReaderGone {};

/// Writes data to stdout and checks that it was written. Throws OutputError, ReaderGone.
void printData(const std::string& text);
/// A table as text, without the details that a terminal on standard output has no room for.
std::string fittedText(const report::Table& table);

}  // namespace catoptric::app
