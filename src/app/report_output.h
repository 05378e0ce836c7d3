// Tables after a run.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "run/sequence/session.h"

namespace catoptric::app {

/// What writeReports() has written, for stdout.
struct Reports {
  std::string text;         ///< the tables
  std::string timingsJson;  ///< of --json
  std::string errorsJson;
};

/// Writes timing and error tables (Markdown, CSV) and a contact sheet of what a run has made, with
/// notes of the frames that failed; some method must have a frame. Says on stderr which files to
/// open.
Reports writeReports(const run::RunConfig& run, const std::vector<run::MethodResult>& results,
                     const std::filesystem::path& out);

}  // namespace catoptric::app
