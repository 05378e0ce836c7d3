#include "study/statistics.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>

#include "report/table.h"

namespace catoptric::study {
namespace {

/// From so many ranks on, the normal distribution is as good: the exact one takes the cube of their
/// number. Ours; statistics_test.cpp compares both.
constexpr std::size_t kManyRanks = 128;
/// The quantile of the normal distribution that belongs to kRankConfidence.
constexpr double kRankDeviations = 2.5758;

/// The largest k for which the k-th smallest of all means of pairs and the k-th largest enclose the
/// shift with the wanted confidence; 0: there is none.
std::size_t rankOfInterval(std::size_t count) {
  if (count >= kManyRanks) {
    const auto n = static_cast<double>(count);
    const double deviation = std::sqrt(n * (n + 1.0) * (2.0 * n + 1.0) / 24.0);
    return static_cast<std::size_t>(n * (n + 1.0) / 4.0 - kRankDeviations * deviation + 0.5);
  }
  const std::vector<double> share = signedRankShares(count);
  double tail = 0.0;
  std::size_t k = 0;
  while (k < share.size() && 2.0 * (tail + share[k]) <= 1.0 - kRankConfidence) tail += share[k++];
  return k;
}

/// Deviations beyond this many times the median one are cut to it: 2.5 standard deviations of a
/// normal distribution. Ours: in engine_test.cpp's simulation 4 let 8 % of settings that are 5 %
/// slower pass as unclear, 2.5 lets 1 %.
constexpr double kOrdinary = 2.5 * 1.4826;
/// Times with more than this many times their share of the whole have a median deviation of their
/// own: builds before a first frame can outweigh all steady frames, and are disturbed for longer.
/// Ours: without it, intervals held the truth 342 times of 400 in engine_test.cpp's simulation of
/// builds that take 2 s; with it, 388 times.
constexpr double kDominates = 2.0;

double logRatio(double a, double b) {
  return std::log(a) - std::log(b);
}

}  // namespace

std::vector<double> signedRankShares(std::size_t count) {
  std::vector<double> share(count * (count + 1) / 2 + 1, 0.0);
  share[0] = 1.0;
  for (std::size_t rank = 1; rank <= count; ++rank)
    for (std::size_t s = share.size(); s-- > 0;)
      share[s] = 0.5 * (share[s] + (s >= rank ? share[s - rank] : 0.0));
  return share;
}

double quantile(std::vector<double> values, double share) {
  assert(!values.empty());
  std::sort(values.begin(), values.end());
  const double place = share * static_cast<double>(values.size() - 1);
  const auto below = static_cast<std::size_t>(place);
  const std::size_t above = std::min(below + 1, values.size() - 1);
  return std::lerp(values[below], values[above], place - static_cast<double>(below));
}

double median(std::vector<double> values) {
  return quantile(std::move(values), 0.5);
}

Shift shiftOf(const std::vector<double>& differences) {
  std::vector<double> means;
  for (std::size_t i = 0; i < differences.size(); ++i)
    for (std::size_t j = i; j < differences.size(); ++j)
      means.push_back(0.5 * (differences[i] + differences[j]));
  std::sort(means.begin(), means.end());
  Shift shift{median(means), {}};
  const std::size_t k = rankOfInterval(differences.size());
  if (k > 0) shift.interval = Interval{means[k - 1], means[means.size() - k]};
  return shift;
}

void PairedTimes::add(const RoundTimes& more, const RoundTimes& moreOfBase) {
  for (std::size_t round = 0; round < std::min(more.size(), moreOfBase.size()); ++round) {
    times.push_back(more[round]);
    base.push_back(moreOfBase[round]);
  }
}

namespace {

/// Logarithms of ratios, of each frame over the rounds and of all frames together.
struct Middle {
  std::vector<double> ofFrame;
  std::vector<double> weights;  ///< how much the whole moves with a frame; they add up to 1
  double all = 0.0;
};

Middle middleOf(const RoundTimes& times, const RoundTimes& base, std::size_t rounds) {
  const std::size_t frames = times[0].size();
  Middle middle{std::vector<double>(frames), std::vector<double>(frames), 0.0};
  std::vector<double> own(frames);
  std::vector<double> other(frames);
  for (std::size_t f = 0; f < frames; ++f) {
    std::vector<double> ratios;
    std::vector<double> means;
    for (std::size_t r = 0; r < rounds; ++r) {
      ratios.push_back(logRatio(times[r][f], base[r][f]));
      means.push_back(0.5 * (std::log(times[r][f]) + std::log(base[r][f])));
    }
    middle.ofFrame[f] = median(ratios);
    own[f] = std::exp(median(means) + 0.5 * middle.ofFrame[f]);
    other[f] = std::exp(median(means) - 0.5 * middle.ofFrame[f]);
  }
  const double sum = std::accumulate(own.begin(), own.end(), 0.0);
  const double sumBase = std::accumulate(other.begin(), other.end(), 0.0);
  for (std::size_t f = 0; f < frames; ++f)
    middle.weights[f] = 0.5 * (own[f] / sum + other[f] / sumBase);
  middle.all = logRatio(sum, sumBase);
  return middle;
}

}  // namespace

Ratio pairedRatio(const RoundTimes& times, const RoundTimes& base) {
  const std::size_t rounds = std::min(times.size(), base.size());
  assert(rounds > 0 && times[0].size() == base[0].size());
  const std::size_t frames = times[0].size();
  const Middle middle = middleOf(times, base, rounds);
  std::vector<double> sizes;
  for (std::size_t r = 0; r < rounds; ++r)
    for (std::size_t f = 0; f < frames; ++f)
      sizes.push_back(std::abs(logRatio(times[r][f], base[r][f]) - middle.ofFrame[f]));
  // How far each round is from the middle; single disturbed times count no more than the largest
  // ordinary ones.
  const double ordinary = kOrdinary * median(sizes);
  std::vector<double> ofRound(rounds, middle.all);
  for (std::size_t f = 0; f < frames; ++f) {
    const bool dominates = middle.weights[f] * static_cast<double>(frames) > kDominates;
    std::vector<double> own;
    for (std::size_t r = 0; r < rounds; ++r) own.push_back(sizes[r * frames + f]);
    const double most = dominates ? std::max(ordinary, kOrdinary * median(own)) : ordinary;
    for (std::size_t r = 0; r < rounds; ++r)
      ofRound[r] += middle.weights[f] *
                    std::clamp(logRatio(times[r][f], base[r][f]) - middle.ofFrame[f], -most, most);
  }
  const Shift shift = shiftOf(ofRound);
  Ratio ratio{std::exp(shift.value), {}, static_cast<int>(rounds), static_cast<int>(frames)};
  const double spread = times == base ? 0.0 : kProcessSpread;  // none beside itself
  if (shift.interval)
    ratio.interval =
        Interval{std::exp(shift.interval->low - spread), std::exp(shift.interval->high + spread)};
  return ratio;
}

Ratio quotient(const Ratio& a, const Ratio& b) {
  Ratio ratio{a.value / b.value, {}, std::min(a.rounds, b.rounds), std::min(a.frames, b.frames)};
  if (a.interval && b.interval)
    ratio.interval =
        Interval{a.interval->low / b.interval->high, a.interval->high / b.interval->low};
  return ratio;
}

TimeVerdict verdictOf(const Ratio& ratio) {
  if (!ratio.interval) return TimeVerdict::Unclear;
  if (ratio.interval->high < 1.0) return TimeVerdict::Faster;
  return ratio.interval->low > 1.0 ? TimeVerdict::Slower : TimeVerdict::Unclear;
}

FrameSeconds frameSeconds(const RoundTimes& times) {
  FrameSeconds result;
  const std::size_t frames = times.empty() ? 0 : times[0].size();
  for (std::size_t f = 0; f < frames; ++f) {
    std::vector<double> rounds;
    for (const std::vector<double>& round : times) rounds.push_back(round[f]);
    result.frames.push_back(median(rounds));
    result.mean += result.frames.back() / static_cast<double>(frames);
    if (result.frames.back() <= result.worst) continue;
    result.worst = result.frames.back();
    result.worstFrame = static_cast<int>(f);
  }
  return result;
}

std::string ratioText(const Ratio& ratio) {
  if (ratio.value == 1.0 && ratio.interval && ratio.interval->low == 1.0) return "1";
  // As many digits as tell the interval's ends apart, at least two.
  const double width = ratio.interval ? ratio.interval->high - ratio.interval->low : 1.0;
  const int decimals = width < 0.02 ? 3 : 2;
  std::string text = report::fixedText(ratio.value, decimals);
  if (!ratio.interval) return text + " (too few rounds to tell)";
  return text + " (" + report::fixedText(ratio.interval->low, decimals) + " to " +
         report::fixedText(ratio.interval->high, decimals) + ")";
}

}  // namespace catoptric::study
