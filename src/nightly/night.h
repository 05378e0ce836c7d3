// A night: every case is measured and kept, so that an interrupted one goes on where it was.
#pragma once

#include <functional>

#include "nightly/history.h"
#include "nightly/lab.h"

namespace catoptric::nightly {

struct NightOptions {
  int rounds = 8;       ///< of a first look at the times
  int mostRounds = 32;  ///< until they are decided
  int againEvery = 4;   ///< of so many timed cases one times tonight's build against itself
  /// What times are compared with: "accepted", and against creep the anchor; "anchor" alone; or, in
  /// place of the accepted one, the build that keptBuild() has found.
  std::string baseline = role::kAccepted;
  std::filesystem::path program;
  std::function<bool()> stopRequested;
  std::function<void(const std::string& what, double share)> progress;
};

/// Cases of a suite for an effort, and with a tag or a name that `only` matches; `only` empty: all.
/// Throws UsageError where there is none.
std::vector<NightCase> casesOf(const NightSuite& suite, const std::string& effort,
                               const std::vector<std::string>& only, Lab& lab);

/// Keeps `program`, with the module that writes frames, in the history's folder. Throws
/// OutputError.
void keepProgram(const History& history, const std::filesystem::path& program,
                 const std::string& build);
/// The kept program's file.
std::filesystem::path keptProgram(const History& history, const std::string& build);
/// The kept build whose fingerprint begins with `text`. Throws UsageError when none does, or
/// several.
std::string keptBuild(const History& history, const std::string& text);
/// Removes programs that nothing refers to, and frames of nights but the newest kRawNights: those
/// that were accepted are kept elsewhere.
void dropOld(const History& history);

/// Measures the cases that the night does not have yet. Throws StudyStopped: the night can go on.
void measureNight(History& history, const Night& night, const std::vector<NightCase>& cases,
                  const Gates& gates, Lab& lab, const NightOptions& options);

/// Begins the suite's night on this machine, or goes on with it, and measures what it lacks;
/// `options.baseline` as --baseline says it. Throws StudyStopped: the night can go on.
Night measureSuite(History& history, const NightSuite& suite, const std::string& effort,
                   const std::vector<std::string>& only, Lab& lab, NightOptions options);

}  // namespace catoptric::nightly
