// Compares two builds of the program directly, without a history: frames bit by bit; times of
// start-up and of the frames' steps, interleaved.
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
  std::filesystem::path program;   ///< the build that is judged
  std::filesystem::path baseline;  ///< the build that it is compared with
  std::filesystem::path folder;    ///< for frames that differ: CASE/now, CASE/baseline
  int rounds = 8;      ///< up to four times as many while a step is undecided; 0: pixels alone
  double gate = 0.05;  ///< a step is slower if it takes longer by more than this fraction
};

/// The time of a step relative to the baseline.
struct StepRatio {
  std::string step;  ///< "frame": the whole frame; "start", "start.bake": before the first frame
  double seconds = 0.0;  ///< time in the baseline
  study::Ratio ratio;
  TimeState state = TimeState::Undecided;
};

struct BuildsComparison {
  std::string failure;     ///< why the judged program cannot render the case
  std::string noBaseline;  ///< why the baseline cannot render the case
  int frames = 0;
  int equal = 0;                         ///< frames whose channels are bit-identical
  std::vector<std::string> differences;  ///< one line per channel of a frame that differs
  std::vector<StepRatio> steps;          ///< longest first; short steps are left out
};

/// Renders a case with both programs. A step counts as slower only if new processes confirm it.
/// Throws StudyStopped.
BuildsComparison compareBuilds(const NightCase& one, Lab& lab, const BuildsOptions& options);

/// The results of comparing two builds on several cases.
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
  /// FramesFailed if the judged program cannot render a case. Otherwise LimitsExceeded if a frame
  /// differs, a step is slower, or no frame was compared. Otherwise Done.
  ExitCode exitCode() const;
  /// A sentence that explains the exit code, for the last line of the output.
  std::string sentence(double gate) const;
};

/// Compares the cases in turn. `progress` receives their names. Throws StudyStopped.
BuildsReport compareCases(const std::vector<NightCase>& cases, Lab& lab,
                          const BuildsOptions& options,
                          const std::function<void(const std::string&, double)>& progress);

}  // namespace catoptric::nightly
