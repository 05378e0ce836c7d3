// Judges a night: from what was measured and the history to verdicts, and with which night each
// fault began.
#pragma once

#include <string>
#include <vector>

#include "nightly/history.h"
#include "nightly/judge.h"

namespace catoptric::nightly {

/// Judges all that was measured of a night, writes the verdicts, moves the accepted builds of what
/// is good, and finishes the night. `mustBeZero`: names of counters.
std::vector<Verdict> judgeNight(History& history, const Night& night, const Gates& gates,
                                const std::vector<std::string>& mustBeZero);

/// How many verdicts of each outcome; acknowledged ones count as skipped.
struct Summary {
  int cases = 0;
  int regressions = 0;
  int crashes = 0;
  int skipped = 0;
  int toAccept = 0;  ///< frames that are new, changed or improved
};
Outcome outcomeOf(const Verdict& verdict);
Summary summaryOf(const std::vector<Verdict>& verdicts);

/// Ratios to the anchor build by night, oldest first, up to this one.
struct TrendPoint {
  int night = 0;
  double value = 1.0;
  double low = 1.0;
  double high = 1.0;
};
std::vector<TrendPoint> trendOf(const History& history, const Night& night, const std::string& name,
                                const std::string& bench);

/// Nights of a trend that go together: a level of time, from one change to the next.
struct Level {
  std::size_t first = 0;  ///< index of its first night
  std::size_t count = 0;
  double value = 1.0;  ///< median
};
std::vector<Level> levelsOf(const std::vector<TrendPoint>& trend);

}  // namespace catoptric::nightly
