// The pictures of a suite: figures whose panels show frames of its runs.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "report/figure.h"
#include "study/stored.h"

namespace catoptric::study {

struct SuitePanel {
  std::string run;
  std::string method;
  int frame = 1;
  std::string
      againstRun;  ///< run of the reference frame; empty: no error and no difference is shown
  std::string againstMethod;
  report::Shown shown;  ///< without its files
  std::string label;    ///< may contain {error}, and in braces what a table cell may contain
  bool reflective = false;
};

struct SuitePicture {
  std::string file;  ///< file name with .png, .pdf or .svg
  std::string title;
  std::vector<std::vector<SuitePanel>> rows;
  std::string stated;  ///< text of the picture as written in the suite
};

/// Throws UsageError with the place of the error.
std::vector<SuitePicture> suitePictures(const Suite& suite);

/// The frames that pictures need: run -> method -> frame numbers.
using NeededFrames = std::map<std::string, std::map<std::string, std::set<int>>>;
NeededFrames framesOf(const SuitePicture& picture);

/// A fingerprint of all that a picture is made from.
std::string printOfPicture(const SuitePicture& picture, StatedPrints& prints);

/// `fileOf` returns the EXR file of a frame.
report::Figure suiteFigure(
    const SuitePicture& picture, const SuiteData& data,
    const std::function<std::filesystem::path(const std::string& run, const std::string& method,
                                              int frame)>& fileOf);

/// The cells in the labels of all pictures.
std::vector<std::string> cellsOfLabels(const Suite& suite);

}  // namespace catoptric::study
