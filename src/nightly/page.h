// The page of a night: failures first, pictures to look at, what to type next. Readable without
// JavaScript, from a file and under a strict Content-Security-Policy.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "nightly/history.h"

namespace catoptric::nightly {

/// Size of a page in a single file.
inline constexpr std::size_t kSingleFileBytes = 10'000'000;

struct PageOptions {
  std::string title;
  std::filesystem::path out;  ///< folder
  bool singleFile = false;
  std::string historyOption;  ///< for the lines to copy
};

/// Writes the page and returns its file. Throws OutputError.
std::filesystem::path writePage(const History& history, const Night& night,
                                const std::vector<Verdict>& verdicts, const PageOptions& options);

}  // namespace catoptric::nightly
