// Statistics of repeated times of two settings: the ratio of their times, its 95 % confidence
// interval, and whether this shows a difference.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace catoptric::study {

double median(std::vector<double> values);
/// The quantile of `values` at the fraction `share` (0..1), linearly interpolated.
double quantile(std::vector<double> values, double share);

struct Interval {
  double low = 0.0;
  double high = 0.0;
};

/// The nominal confidence of the rank test, chosen so that 95 % of the intervals contain the true
/// value. Outliers are winsorized, which makes rounds look more alike than they are. With a nominal
/// 95 %, intervals of 8 rounds contained the true value in 91 % of 2,000 simulated measurements (as
/// in engine_test.cpp); with 99 %, in 97 %. Our choice.
inline constexpr double kRankConfidence = 0.99;
/// The relative difference between two processes of the same program, which lasts for their whole
/// lifetime. More rounds cannot distinguish it from a difference of the settings, so intervals are
/// widened by it. Of 21 intervals (32 rounds, --clock cpu, pairs of processes in the setting of
/// tests/same_twice.py), 17 contained the true value without it and 20 with it. Our choice.
inline constexpr double kProcessSpread = 0.005;
/// Fewer rounds cannot give an interval: with 7 rounds, the smallest possible p, 2 / 2^7, is above
/// 1 %.
inline constexpr int kLeastRounds = 8;

/// The null distribution of the signed-rank statistic for `count` ranks: entry s is the fraction of
/// sign choices whose positive ranks add up to s. [Wilcoxon1945]
std::vector<double> signedRankShares(std::size_t count);

/// The median of the means of all pairs, with an interval from the exact distribution of the
/// signed-rank statistic. It assumes that the differences are symmetric, and nothing else about
/// their distribution. [Hodges1963] Sec. 4; [Wilcoxon1945]
struct Shift {
  double value = 0.0;
  std::optional<Interval> interval;  ///< nullopt with too few values
};
Shift shiftOf(const std::vector<double>& differences);

/// Times of one setting in seconds, by round, then by frame.
using RoundTimes = std::vector<std::vector<double>>;

/// Times of two settings from several measurements, of each the rounds that both have.
struct PairedTimes {
  RoundTimes times;
  RoundTimes base;
  void add(const RoundTimes& more, const RoundTimes& moreOfBase);
};

/// The ratio of the times of two settings, over all frames together.
struct Ratio {
  double value = 1.0;
  std::optional<Interval> interval;  ///< nullopt: too few rounds
  int rounds = 0;
  int frames = 0;
};

/// The ratio of two settings, from the first rounds, as many as both have. They were measured
/// directly after one another.
/// A frame's ratio is the median over its rounds, so a single disturbed time has no influence.
/// Frames are weighted by their times. The interval is computed over rounds, because frames of one
/// round share its disturbances. Exchanging the settings yields exactly the reciprocal.
Ratio pairedRatio(const RoundTimes& times, const RoundTimes& base);

/// a / b, from a / base and b / base that were measured separately. The interval combines the
/// widths of both.
Ratio quotient(const Ratio& a, const Ratio& b);

enum class TimeVerdict { Faster, Slower, Unclear };
/// Faster or Slower if the interval excludes 1, otherwise Unclear.
TimeVerdict verdictOf(const Ratio& ratio);

/// The seconds of each frame (median over the rounds), their mean over the frames, and the slowest
/// frame.
struct FrameSeconds {
  double mean = 0.0;
  double worst = 0.0;
  int worstFrame = -1;  ///< index of the slowest frame
  std::vector<double> frames;
};
FrameSeconds frameSeconds(const RoundTimes& times);

/// For example "0.74 (0.71 to 0.77)" or "0.74 (too few rounds to tell)".
std::string ratioText(const Ratio& ratio);

}  // namespace catoptric::study
