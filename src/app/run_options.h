// Makes a run config from command-line options.
#pragma once

#include "app/commands.h"
#include "run/config/run_config.h"

namespace catoptric::app {

/// A config after the command line's changes, as JSON and parsed.
struct InputConfig {
  config::Value root;
  run::RunConfig run;
};
/// The folders in which scenes/, paths/ and configs/ are looked for: the working folder, and the
/// one that is installed with the program.
std::vector<std::filesystem::path> dataFolders();
/// The file `name`, or the first file of that name, with or without its extension, in a folder
/// `kinds` of dataFolders(). Otherwise `name`.
std::string listedFile(const std::string& name, const std::vector<std::string>& kinds);

/// As readRun(), but also returns the JSON, and does not set the thread count.
InputConfig readConfig(const RunOptions& options);

/// The text of a run config that has the same meaning wherever its file lies: it contains the
/// command line's changes, except for --method, and absolute file names.
std::string portableConfig(const InputConfig& input);

/// Reads the config or scene `options.input` and applies the options: --set from left to right,
/// then the named options. Sets the thread count. Throws UsageError.
run::RunConfig readRun(const RunOptions& options);

/// The run config of the scene `options.input`, with the options of sceneRows(). The file is not
/// read. Throws UsageError.
run::RunConfig readScene(const RunOptions& options);

}  // namespace catoptric::app
