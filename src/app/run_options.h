// From command-line options to a run config.
#pragma once

#include "app/commands.h"
#include "run/config/run_config.h"

namespace catoptric::app {

/// Reads the config or scene of `options.input` with the options applied, in this order: the file,
/// --set from left to right, the named options. Sets the thread count. Throws UsageError.
run::RunConfig readRun(const RunOptions& options);

}  // namespace catoptric::app
