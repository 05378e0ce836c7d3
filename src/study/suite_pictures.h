// The pictures of a suite: figures whose panels are frames of its runs.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "report/figure.h"
#include "study/suite.h"

namespace catoptric::study {

struct SuitePanel {
  std::string run;
  std::string method;
  int frame = 1;
  std::string againstRun;  ///< empty: neither an error nor a difference
  std::string againstMethod;
  report::Shown shown;  ///< without its files
  std::string label;    ///< with {error} and cells in braces
  bool reflective = false;
};

struct SuitePicture {
  std::string file;  ///< its name, with .png, .pdf or .svg
  std::string title;
  std::vector<std::vector<SuitePanel>> rows;
  std::string stated;  ///< as it is written
};

/// Throws UsageError with the place of what is wrong.
std::vector<SuitePicture> suitePictures(const Suite& suite);

/// Frames that the pictures need: "RUN" -> "METHOD" -> numbers.
using NeededFrames = std::map<std::string, std::map<std::string, std::set<int>>>;
NeededFrames framesOf(const SuitePicture& picture);

/// What a picture is made of: as statedPrint().
std::string statedPrint(const Suite& suite, const SuitePicture& picture, const std::string& effort);

/// `fileOf`: the EXR file of a frame of a run's method.
report::Figure suiteFigure(
    const SuitePicture& picture, const SuiteData& data,
    const std::function<std::filesystem::path(const std::string& run, const std::string& method,
                                              int frame)>& fileOf);

/// Cells in the labels of all pictures.
std::vector<std::string> cellsOfLabels(const Suite& suite);

}  // namespace catoptric::study
