// Compares a run with a reference run, frame by frame.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "measure/errors.h"
#include "measure/motion.h"
#include "report/run_data.h"

namespace catoptric::report {

struct RunComparison {
  std::string name;
  std::string reference;
  std::map<int, measure::ImageError> frames;
  measure::ImageError pooled;
  measure::MotionError motion;       ///< over consecutive frames
  std::vector<int> onlyInRun;        ///< frames that the reference lacks
  std::vector<int> onlyInReference;  ///< frames that the run lacks
  std::map<int, std::string> objectNames;
};

/// Where compareRuns() writes pictures.
struct PictureOptions {
  std::filesystem::path folder;  ///< empty: no pictures are written
  /// A folder for 0001.png, 0002.png and so on, one for each compared frame: run, reference and the
  /// change of the error since the frame before, side by side. Empty: none are written.
  std::filesystem::path film = {};
};

/// Compares all frames that both runs have, read from their EXR files. If a folder is given, writes
/// pictures of each (report/differences.h). Throws UsageError if there are no common frames.
RunComparison compareRuns(const RunData& run, const RunData& reference,
                          const measure::CompareOptions& options = {},
                          const PictureOptions& pictures = {});

}  // namespace catoptric::report
