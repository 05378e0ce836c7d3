// Merges chunks of a run, rendered by several processes or machines, into one run folder.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "run/folder/run_folder.h"

namespace catoptric::run {

struct MergedRun {
  std::string name;              ///< name of the method
  std::filesystem::path folder;  ///< folder of the merged run
  std::string config;            ///< JSON text of the run's effective config; "{}" if unknown
  std::vector<int> frames;
};

/// Merges `runs` into `out`. Each is a folder as `render` writes it: of one method, or with a
/// folder per method. Everything is checked before anything is written: every requested frame is in
/// a run; files have their recorded contents; settings, scene, program and renderer are the same in
/// all runs. Processors may differ, with a warning. A frame may occur twice if its files are
/// identical. All errors are reported at once. The result does not depend on the order of `runs`.
/// Frames become hard links where the file system allows it. Throws UsageError for runs that do not
/// match, Error(FramesFailed) for missing or damaged frames, and OutputError.
std::vector<MergedRun> mergeRuns(const std::vector<std::filesystem::path>& runs,
                                 const std::filesystem::path& out, Existing existing);

}  // namespace catoptric::run
