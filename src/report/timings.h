// Timing tables: per step min, median, mean, max over frames; preparation apart from frames;
// several methods side by side with ratios.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "report/run_data.h"
#include "report/table.h"

namespace catoptric::report {

/// Of a step's sums per frame (several samples of one step in a frame add up). Seconds.
struct StepStatistics {
  std::string step;
  std::string clock;
  int count = 0;  ///< frames (or samples, of preparation) with this step
  double min = 0.0;
  double median = 0.0;
  double mean = 0.0;
  double max = 0.0;
  double sum = 0.0;
  /// Mean over frames marked `first` (they are part of all others too); negative: none marked.
  double first = -1.0;
};

struct TimingTable {
  std::string name;
  int frames = 0;
  std::vector<StepStatistics> preparation;  ///< frame 0: start-up, load, precomputation
  std::vector<StepStatistics> steps;        ///< in the order in which they first occur
  std::vector<StepStatistics> apart;        ///< no rendering: `wait` for the writers, checks
  std::vector<StepStatistics> overlapped;   ///< beside rendering: encode, write
  StepStatistics rendering;                 ///< per frame, all of `steps`
  StepStatistics frame;                     ///< per frame, `apart` included

  const StepStatistics* find(const std::string& step) const;
};

TimingTable timingTable(const RunData& run);

/// One method: ms, share of the rendering, frames per second.
Table timingView(const TimingTable& timings);
/// Several methods: median ms of each step over the frames that have it (first frames, which pay
/// for allocation, hardly move it), and how much longer each takes than "traced", else "reference",
/// else the first.
Table timingComparison(std::span<const TimingTable> methods);
/// What the methods counted: mean per frame, and the most of a frame where it differs. Counters
/// that are 0 everywhere stand in a note.
Table counterView(std::span<const RunData> runs);
/// Long form, seconds: method,kind,step,clock,count,min,median,mean,max,sum,first; `kind` is
/// preparation, step, apart, overlapped, or total.
std::string timingCsv(std::span<const TimingTable> methods);
/// [{"name", "frames", "rendering": {...}, "steps": [...], "preparation": [...], ...}], in seconds.
std::string timingJson(std::span<const TimingTable> methods);

}  // namespace catoptric::report
