// Judges a night: makes verdicts from its measurements and the history, and finds the night in
// which each fault began.
#pragma once

#include <string>
#include <vector>

#include "nightly/history.h"
#include "nightly/judge.h"

namespace catoptric::nightly {

/// Judges all measurements of a night, writes the verdicts, makes good builds the accepted ones,
/// and finishes the night. `mustBeZero`: names of counters that must be 0.
std::vector<Verdict> judgeNight(History& history, const Night& night, const Gates& gates,
                                const std::vector<std::string>& mustBeZero);

/// The time of a case relative to the anchor build, in one night. trendOf() returns them, oldest
/// first.
struct TrendPoint {
  int night = 0;
  double value = 1.0;
  double low = 1.0;
  double high = 1.0;
};
std::vector<TrendPoint> trendOf(const History& history, const Night& night, const std::string& name,
                                const std::string& bench);

/// A level of a trend: the nights between two changes.
struct Level {
  std::size_t first = 0;  ///< index of its first night
  std::size_t count = 0;
  double value = 1.0;  ///< median
};
std::vector<Level> levelsOf(const std::vector<TrendPoint>& trend);

}  // namespace catoptric::nightly
