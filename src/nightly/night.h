// Runs a night: measures every case and stores it, so that an interrupted night can be continued.
#pragma once

#include <functional>

#include "nightly/history.h"
#include "nightly/lab.h"

namespace catoptric::nightly {

struct NightOptions {
  int rounds = 8;       ///< rounds of the first measurement of times
  int mostRounds = 32;  ///< maximum number of rounds until times are decided
  int againEvery = 4;   ///< every n-th timed case also times tonight's build against itself
  /// The baseline of times. "accepted": the accepted build, and the anchor to detect creep.
  /// "anchor": the anchor alone. Otherwise a build that keptBuild() has found, instead of the
  /// accepted one.
  std::string baseline = role::kAccepted;
  std::filesystem::path program;
  std::function<bool()> stopRequested;
  std::function<void(const std::string& what, double share)> progress;
};

/// The cases of a suite for an effort. `only` selects cases by tags and by patterns of names;
/// empty: all cases. Throws UsageError if no case is left.
std::vector<NightCase> casesOf(const NightSuite& suite, const std::string& effort,
                               const std::vector<std::string>& only, Lab& lab);

/// Stores `program`, and the module that writes frames, in the history's folder. Throws
/// OutputError.
void keepProgram(const History& history, const std::filesystem::path& program,
                 const std::string& build);
/// The file of a stored program.
std::filesystem::path keptProgram(const History& history, const std::string& build);
/// The stored build whose fingerprint begins with `text`. Throws UsageError unless there is exactly
/// one.
std::string keptBuild(const History& history, const std::string& text);
/// Removes programs that nothing refers to, and the frames of all nights except the newest
/// kRawNights. Accepted frames are stored elsewhere and stay.
void dropOld(const History& history);

/// Measures the cases that the night lacks. Throws StudyStopped; the night can then be continued.
void measureNight(History& history, const Night& night, const std::vector<NightCase>& cases,
                  const Gates& gates, Lab& lab, const NightOptions& options);

/// Begins the suite's night on this machine, or continues it, and measures the cases that it lacks.
/// `options.baseline` is the value of --baseline. Throws StudyStopped; the night can then be
/// continued.
Night measureSuite(History& history, const NightSuite& suite, const std::string& effort,
                   const std::vector<std::string>& only, Lab& lab, NightOptions options);

}  // namespace catoptric::nightly
