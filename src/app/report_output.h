// Tables after a run.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "run/sequence/session.h"

namespace catoptric::app {

/// The reports that writeReports() has written, for stdout.
struct Reports {
  std::string text;         ///< the tables
  std::string timingsJson;  ///< for --json
  std::string errorsJson;
};

/// Writes timing and error tables (Markdown, CSV) and a contact sheet of a run, with notes about
/// failed frames. At least one method must have a frame. Logs which files to open. `amortize`: as
/// for report::timingTable().
Reports writeReports(const run::RunConfig& run, const std::vector<run::MethodResult>& results,
                     const std::filesystem::path& out, int amortize = 0);

}  // namespace catoptric::app
