// Timing tables: minimum, median, mean and maximum of each step over frames. Preparation is
// separate from frames. Tables of several methods are side by side.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "report/run_data.h"
#include "report/table.h"

namespace catoptric::report {

/// What tables say about first frames.
inline constexpr const char* kFirstFrames =
    "First frame: with what the method builds before it (BVH, programs, levels).";

/// Statistics of a step over frames, in seconds. Several samples of one frame are added up first.
struct StepStatistics {
  std::string step;
  std::string clock;
  int count = 0;  ///< number of frames with this step (for preparation: of samples)
  double min = 0.0;
  double median = 0.0;
  double mean = 0.0;
  double max = 0.0;
  double sum = 0.0;
  /// Mean over the frames marked `first`, which the other values include too. Negative: none.
  double first = -1.0;
};

struct TimingTable {
  std::string name;
  int frames = 0;
  std::vector<StepStatistics> preparation;  ///< frame 0: start-up, loading, precomputation
  std::vector<StepStatistics> steps;        ///< in the order of their first occurrence
  std::vector<StepStatistics>
      apart;  ///< steps that are not rendering: `wait` for the writers, checks
  std::vector<StepStatistics> overlapped;  ///< steps parallel to rendering: encode, write
  StepStatistics rendering;                ///< per frame: the sum of all `steps`
  StepStatistics frame;                    ///< per frame: `steps` and `apart`
  /// Rendering of the frames marked `first`, each with what the method builds before it: BVH,
  /// programs, levels, but not reading the scene and baking light.
  StepStatistics first;
  StepStatistics steady;  ///< rendering of all other frames
  std::string note;       ///< why these times are not those of consecutive frames; empty: they are
  int amortize = 0;       ///< frames that share what is built
  /// Mean time of a frame at the end of `amortize` frames, with all that is built. nullopt: first
  /// or steady frames are missing.
  std::optional<double> mean;
  const StepStatistics* find(const std::string& step) const;
};

/// `amortize`: TimingTable::amortize; 0: the frames of the run's path.
TimingTable timingTable(const RunData& run, int amortize = 0);

/// One method: ms, fraction of the rendering, frames per second.
Table timingView(const TimingTable& timings);
/// Several methods: the median time of each step in ms, over the frames that have it (so first
/// frames, which include allocation, have little influence). No ratios: the methods did not run in
/// turns.
Table timingComparison(std::span<const TimingTable> methods);
/// The counters of the methods: the mean per frame, and the maximum if it differs. Counters that
/// are always 0 are listed in a note.
Table counterView(std::span<const RunData> runs);
/// CSV in long form, seconds: method,kind,step,clock,count,min,median,mean,max,sum,first. `kind` is
/// preparation, step, apart, overlapped, or total.
std::string timingCsv(std::span<const TimingTable> methods);
/// JSON, seconds: [{"name", "frames", "rendering": {...}, "steps": [...], "preparation": [...],
/// ...}].
std::string timingJson(std::span<const TimingTable> methods);

}  // namespace catoptric::report
