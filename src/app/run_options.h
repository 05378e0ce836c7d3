// From command-line options to a run config.
#pragma once

#include "app/commands.h"
#include "run/config/run_config.h"

namespace catoptric::app {

/// A config with the command line's changes, and what it means.
struct InputConfig {
  config::Value root;
  run::RunConfig run;
};
/// As readRun(), without setting the thread count.
InputConfig readConfig(const RunOptions& options);

/// Text of a run config that says the same wherever its file stands: with the command line's
/// changes but for --method, files by their absolute names.
std::string portableConfig(const InputConfig& input);

/// Reads the config or scene of `options.input` with the options applied, in this order: the file,
/// --set from left to right, the named options. Sets the thread count. Throws UsageError.
run::RunConfig readRun(const RunOptions& options);

}  // namespace catoptric::app
