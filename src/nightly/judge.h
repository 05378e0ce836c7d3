// What times, pictures and counters say: rules without files or history.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "nightly/facts.h"
#include "nightly/gates.h"

namespace catoptric::nightly {

enum class TimeState { Holds, Fails, Undecided };

/// How many times as long as a baseline, over one attempt or both.
struct TimeRatio {
  study::Ratio ratio;
  TimeState state = TimeState::Undecided;
  double p = 1.0;  ///< that it is within the gate, from the rounds alone
};

/// What a regression may be against: builds other than tonight's.
inline constexpr std::array<const char*, 3> kBaselines = {role::kAccepted, role::kAnchor,
                                                          role::kNamed};

/// Fails: the whole interval is above 1 + gate; holds: it is below; undecided otherwise.
TimeState stateOf(const study::Ratio& ratio, double gate);
/// Of one attempt of a role; none: it was not measured.
std::optional<TimeRatio> timeRatio(const CaseFacts& facts, const char* ofRole, int attempt,
                                   double gate);
/// A failure has to repeat in fresh processes; without a second attempt it is undecided.
std::optional<TimeRatio> confirmedRatio(const CaseFacts& facts, const char* ofRole, double gate);

/// Probability of signed ranks as large as those of `values`, if they were symmetric about 0;
/// exact. [Wilcoxon1945]
double signedRankP(const std::vector<double>& values);

/// Which of several tests may be called positive so that at most `share` of such calls are wrong.
/// [Benjamini1995]
std::vector<bool> falseDiscoveries(const std::vector<double>& p, double share);

/// Where a series changes its level: indexes of the first value of each level but the first.
/// Minimizes the sum of distances to the levels' medians plus `penalty` for each change.
/// [Friedrich2008]
std::vector<std::size_t> changePoints(const std::vector<double>& values, double penalty);

/// Differences of a frame from the accepted one, by Gates::picture's names and more.
using PictureErrors = std::map<std::string, double>;

struct PictureState {
  std::string status;  ///< same, within, changed, improved
  std::string message;
  double value = 0.0;  ///< of the measure that exceeds its limit most
};
/// `truth`: errors (L1_8bit) of tonight's and the accepted frame against the truth, where known.
PictureState judgePicture(const PictureErrors& errors, const Gates& gates,
                          const std::optional<std::pair<double, double>>& truth);

/// Counters of a frame that are worse than the accepted ones; a line each.
std::vector<std::string> worseCounters(const std::map<std::string, std::uint64_t>& now,
                                       const std::map<std::string, std::uint64_t>& accepted,
                                       const std::vector<std::string>& mustBeZero,
                                       const Gates& gates);

}  // namespace catoptric::nightly
