// A run against another, frame by frame.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "measure/errors.h"
#include "report/run_data.h"

namespace catoptric::report {

struct RunComparison {
  std::string name;
  std::string reference;
  std::map<int, measure::ImageError> frames;
  measure::ImageError pooled;
  std::vector<int> onlyInRun;        ///< frames that the reference lacks
  std::vector<int> onlyInReference;  ///< frames that the run lacks
  std::map<int, std::string> objectNames;
};

/// Where compareRuns puts pictures.
struct PictureOptions {
  std::filesystem::path folder;  ///< empty: none
};

/// All frames that both have, read from their EXR files; with a folder, pictures of each as
/// report/differences.h says. Throws UsageError when there are none.
RunComparison compareRuns(const RunData& run, const RunData& reference,
                          const measure::CompareOptions& options = {},
                          const PictureOptions& pictures = {});

}  // namespace catoptric::report
