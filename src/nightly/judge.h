// Rules that judge times, pictures and counters; they use no files and no history.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "nightly/facts.h"
#include "nightly/gates.h"

namespace catoptric::nightly {

enum class TimeState { Holds, Fails, Undecided };

/// The time relative to a baseline, over one attempt or both.
struct TimeRatio {
  study::Ratio ratio;
  TimeState state = TimeState::Undecided;
  double p =
      1.0;  ///< p-value, from the rounds alone, of the hypothesis that the ratio is within the gate
};

/// The baselines that can reveal a regression: builds other than tonight's.
inline constexpr std::array<const char*, 3> kBaselines = {role::kAccepted, role::kAnchor,
                                                          role::kNamed};

/// Fails: the whole interval is above 1 + gate. Holds: the whole interval is below it. Otherwise
/// undecided.
TimeState stateOf(const study::Ratio& ratio, double gate);
/// The time of tonight's build relative to that of the build with this role, in one attempt;
/// nullopt: not measured.
std::optional<TimeRatio> timeRatio(const CaseFacts& facts, const char* ofRole, int attempt,
                                   double gate);
/// The ratio after confirmation: a failure must repeat in new processes. Without a second attempt
/// it is undecided.
std::optional<TimeRatio> confirmedRatio(const CaseFacts& facts, const char* ofRole, double gate);

/// The exact probability of signed ranks at least as large as those of `values`, if the values were
/// symmetric about 0. [Wilcoxon1945]
double signedRankP(const std::vector<double>& values);

/// Tells which of several tests may be called positive if at most the fraction `share` of the
/// positives may be false. [Benjamini1995]
std::vector<bool> falseDiscoveries(const std::vector<double>& p, double share);

/// The change points of a series: the index of the first value of each level except the first.
/// Minimizes the sum of distances to the levels' medians plus `penalty` per change. [Friedrich2008]
std::vector<std::size_t> changePoints(const std::vector<double>& values, double penalty);

/// Differences of a frame from the accepted frame, by the names of Gates::picture and some others.
using PictureErrors = std::map<std::string, double>;

struct PictureState {
  std::string status;  ///< same, within, changed or improved
  std::string message;
  double value = 0.0;  ///< value of the measure that exceeds its limit most
};
/// `truth`: the errors (L1_8bit) of tonight's and the accepted frame against the reference.
PictureState judgePicture(const PictureErrors& errors, const Gates& gates,
                          const std::optional<std::pair<double, double>>& truth);

/// The counters of a frame that are worse than the accepted ones, one line each.
std::vector<std::string> worseCounters(const std::map<std::string, std::uint64_t>& now,
                                       const std::map<std::string, std::uint64_t>& accepted,
                                       const std::vector<std::string>& mustBeZero,
                                       const Gates& gates);

}  // namespace catoptric::nightly
