// render --repeats: the methods of a run, timed in turns.
#pragma once

#include <filesystem>
#include <string>

#include "app/commands.h"
#include "app/progress.h"
#include "run/config/run_config.h"

namespace catoptric::app {

struct RepeatOptions {
  int repeats = 0;
  std::string ratioTo;  ///< empty: traced, else reference, else the first method
};

/// Throws UsageError for a method that the run has not.
std::string ratioMethod(const run::RunConfig& run, const RepeatOptions& options);

struct RepeatedTimes {
  std::string text;
  std::string json;
};

/// Times all methods of the run in turns; the samples and the table stay in `out`/repeats.
RepeatedTimes measureRepeats(const RunOptions& options, const run::RunConfig& run,
                             const std::filesystem::path& out, const RepeatOptions& repeat,
                             ProgressPrinter& printer);

}  // namespace catoptric::app
