// Contact sheets: one picture of the previews of runs: a row per method, a column per frame.
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
  int cellWidth = 320;  ///< largest width, in pixels
  int maxColumns = 5;   ///< for several methods: frames; for one method: cells per row
  int maxFrames = 20;   ///< largest number of frames, for one method
  /// Text after a method's name, e.g. "143 ms, L1 0.35"; indexed by that name.
  std::map<std::string, std::string> captions;
};

/// For one run, its frames row by row. For several runs, a row per run and a column per frame. If
/// there are too many frames, evenly spaced ones are shown, including the first and the last.
/// Previews are used unchanged; a frame without one is converted by OpenColorIO. A frame that a run
/// lacks is marked as missing. Throws UsageError if no run has a frame, SceneError for damaged
/// files.
Figure contactSheet(std::span<const RunData> runs, const SheetOptions& options = {});

/// Picks `count` evenly spaced elements of `all`, including the first and the last.
std::vector<int> spread(const std::vector<int>& all, std::size_t count);

}  // namespace catoptric::report
