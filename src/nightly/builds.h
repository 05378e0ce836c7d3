// Two builds of the program beside each other, without a history: frames bit for bit, and the times
// of their steps in turns.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "nightly/judge.h"
#include "nightly/lab.h"

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
  std::string step;      ///< "frame": all of them
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

}  // namespace catoptric::nightly
