// Contact sheets: the previews of runs on one picture, rows of methods and columns of frames.
#pragma once

#include <map>
#include <span>
#include <string>
#include <vector>

#include "report/figure.h"
#include "report/run_data.h"

namespace catoptric::report {

struct SheetOptions {
  std::string title;
  int cellWidth = 320;  ///< pixels, at most
  int maxColumns = 5;   ///< frames of several methods; of one method: cells in a row
  int maxFrames = 20;   ///< of one method
  /// Text beside a method's name, by name: "143 ms, L1 0.35".
  std::map<std::string, std::string> captions;
};

/// One run: its frames row by row. Several: a row for each, and a column for each frame. Of too
/// many frames evenly spread ones are shown, the first and the last among them. Previews are taken
/// as they are; a frame without one goes through OpenColorIO. A frame that a run lacks says so.
/// Throws UsageError when no run has a frame, SceneError for damaged files.
Figure contactSheet(std::span<const RunData> runs, const SheetOptions& options = {});

/// `count` of `all`, evenly spread, first and last included.
std::vector<int> spread(const std::vector<int>& all, std::size_t count);

}  // namespace catoptric::report
