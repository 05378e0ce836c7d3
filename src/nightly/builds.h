// Two builds of the program beside each other, without a history: frames bit for bit, and the times
// of their starts and of the steps of frames in turns.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "core/error.h"
#include "nightly/judge.h"
#include "nightly/lab.h"
#include "report/table.h"

namespace catoptric::nightly {

struct BuildsOptions {
  std::filesystem::path program;   ///< that is judged
  std::filesystem::path baseline;  ///< another build of it
  std::filesystem::path folder;    ///< frames that differ: CASE/now, CASE/baseline
  int rounds = 8;                  ///< up to four times as many while a step is undecided
  double gate = 0.05;              ///< a step that takes longer by more than this share is slower
};

/// How many times as long as in the baseline.
struct StepRatio {
  std::string step;      ///< "frame": all of a frame; "start", "start.bake": before the first one
  double seconds = 0.0;  ///< of the baseline
  study::Ratio ratio;
  TimeState state = TimeState::Undecided;
};

struct BuildsComparison {
  std::string failure;     ///< why the judged program cannot render the case
  std::string noBaseline;  ///< why the baseline cannot
  int frames = 0;
  int equal = 0;                         ///< frames whose channels have the same bits
  std::vector<std::string> differences;  ///< a line for each channel of a frame that differs
  std::vector<StepRatio> steps;          ///< the longest first; short ones are left out
};

/// Renders a case by both programs. A step that fails has failed in fresh processes, too. Throws
/// StudyStopped.
BuildsComparison compareBuilds(const NightCase& one, Lab& lab, const BuildsOptions& options);

/// What two builds made of several cases.
struct BuildsReport {
  report::Table table{
      "", {{"case", false}, {"what", false}, {"verdict", false}, {"", false}}, {}, {}};
  int frames = 0;
  int equal = 0;
  int slower = 0;
  int undecided = 0;
  int crashes = 0;
  int withoutBaseline = 0;

  void add(const std::string& name, const BuildsComparison& one);
  /// FramesFailed, LimitsExceeded where a frame differs or a step is slower, or Done.
  ExitCode exitCode() const;
  /// What the exit code says, as the last line of the output.
  std::string sentence(double gate) const;
};

/// Compares the cases one after the other; `progress` is told their names. Throws StudyStopped.
BuildsReport compareCases(const std::vector<NightCase>& cases, Lab& lab,
                          const BuildsOptions& options,
                          const std::function<void(const std::string&, double)>& progress);

}  // namespace catoptric::nightly
