// Tables after a run.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "run/sequence/session.h"

namespace catoptric::app {

/// Writes timing and error tables (Markdown, CSV) and contact sheets of what a run has made, with
/// notes of the frames that failed; some method must have a frame. Says on
/// stderr which files to open, and returns the tables as text, or the errors as JSON.
std::string writeReports(const run::RunConfig& run, const std::vector<run::MethodResult>& results,
                         const std::filesystem::path& out, bool json);

}  // namespace catoptric::app
