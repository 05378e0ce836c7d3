// The commands: each is a table of options, and a function that runs when it was chosen.
#pragma once

#include <string>
#include <vector>

#include "app/command.h"
#include "core/error.h"

namespace catoptric::app {

/// Options of every subcommand.
struct CommonOptions {
  bool json = false;
  bool quiet = false;
  int verbose = 0;
  std::string shaderFolder;
};

/// Options of what renders or plans.
struct RunOptions {
  std::string input;
  std::string out;
  std::string frames;
  std::string environment;
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
/// status, retry, cancel: of what was submitted.
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

/// All of them, in the order of the help page.
Program makeProgram(CommonOptions& common);

/// Reads the command line (without the program's name) and runs the command. Throws what it throws,
/// and UsageError for what cannot be understood.
ExitCode runProgram(std::vector<std::string> arguments);

/// --json, -q, -v.
Rows commonRows(CommonOptions& common);
/// CONFIG|SCENE, --frames, --method, --set, --device, --threads, --seed, --shader-dir, and the
/// common options.
Rows runRows(RunOptions& options, CommonOptions& common);

/// What reads stdout has seen enough (`| head`): no error of ours.
struct ReaderGone {};

/// Writes data to stdout, and checks that it arrived. Throws OutputError, ReaderGone.
void printData(const std::string& text);

}  // namespace catoptric::app
