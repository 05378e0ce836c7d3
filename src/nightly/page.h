// The page of a night: failures first, then pictures, and the commands to type next. It is readable
// without JavaScript, as a local file, and under a strict Content-Security-Policy.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "nightly/history.h"

namespace catoptric::nightly {

/// Largest size of a page in a single file.
inline constexpr std::size_t kSingleFileBytes = 10'000'000;

struct PageOptions {
  std::string title;
  std::filesystem::path out;  ///< folder for the page
  bool singleFile = false;
  std::string historyOption;  ///< names the history in commands that the page offers to copy
};

/// Writes the page and returns the path of its file. Throws OutputError.
std::filesystem::path writePage(const History& history, const Night& night,
                                const std::vector<Verdict>& verdicts, const PageOptions& options);

}  // namespace catoptric::nightly
