// Chunks of a run, rendered by several processes or machines, into one run folder.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "run/folder/run_folder.h"

namespace catoptric::run {

struct MergedRun {
  std::string name;              ///< of the method
  std::filesystem::path folder;  ///< of the merged run
  std::string config;            ///< JSON text of the run's effective config; "{}" when unknown
  std::vector<int> frames;
};

/// Merges `runs` (folders as `render` fills them: of one method, or with a folder per method) into
/// `out`. All is checked before anything is written: every wanted frame is in one run, files have
/// their recorded contents, and all were made with the same settings, scene, program and renderer
/// (the processors may differ: a warning says so); the same frame twice is allowed where its files
/// are the same. All that is wrong is said at once. The result does not depend on the order of
/// `runs`; frames are hard links where the file system can. Throws UsageError for what does not fit
/// together, Error(FramesFailed) for frames that are missing or damaged, OutputError.
std::vector<MergedRun> mergeRuns(const std::vector<std::filesystem::path>& runs,
                                 const std::filesystem::path& out, Existing existing);

}  // namespace catoptric::run
