#include "study/statistics.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace catoptric::study {
namespace {

TEST(Statistics, QuantileLiesBetweenTheNeighbours) {
  EXPECT_EQ(median({3, 1, 2}), 2.0);
  EXPECT_EQ(median({4, 1, 2, 3}), 2.5);
  EXPECT_EQ(quantile({0, 10}, 0.25), 2.5);
  EXPECT_EQ(quantile({5}, 0.9), 5.0);
}

// The 10 means of pairs of 1, 2, 4, 8 are 1 1.5 2 2.5 3 4 4.5 5 6 8.
TEST(Statistics, ShiftIsTheMedianOfAllMeansOfPairs) {
  const Shift shift = shiftOf({1, 2, 4, 8});
  EXPECT_DOUBLE_EQ(shift.value, 3.5);
  EXPECT_FALSE(shift.interval);  // 2 / 2^4 is more than 1 %
}

// Printed tables of the signed-rank statistic: with 8 values only the extremes hold 99 %, with 10
// the 4th means from both ends (two-sided critical value 3).
TEST(Statistics, IntervalFollowsTheExactDistribution) {
  const Shift eight = shiftOf({8, 7, 6, 5, 4, 3, 2, 1});
  ASSERT_TRUE(eight.interval);
  EXPECT_EQ(eight.interval->low, 1.0);
  EXPECT_EQ(eight.interval->high, 8.0);
  std::vector<double> ten;
  std::vector<double> means;
  for (int i = 1; i <= 10; ++i) ten.push_back(i * i);
  for (std::size_t i = 0; i < 10; ++i)
    for (std::size_t j = i; j < 10; ++j) means.push_back((ten[i] + ten[j]) / 2);
  std::sort(means.begin(), means.end());
  const Shift shift = shiftOf(ten);
  ASSERT_TRUE(shift.interval);
  EXPECT_EQ(shift.interval->low, means[3]);
  EXPECT_EQ(shift.interval->high, means[means.size() - 4]);
}

// Of many values the normal distribution replaces the exact one.
TEST(Statistics, IntervalOfManyValuesIsOfTheSameRanks) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  for (const std::size_t count : {127, 128, 200}) {
    std::vector<double> values(count);
    for (double& value : values) value = normal(random);
    std::vector<double> means;
    for (std::size_t i = 0; i < count; ++i)
      for (std::size_t j = i; j < count; ++j) means.push_back(0.5 * (values[i] + values[j]));
    std::sort(means.begin(), means.end());
    const std::vector<double> share = signedRankShares(count);
    double tail = 0.0;
    std::size_t k = 0;
    while (2.0 * (tail + share[k]) <= 1.0 - kRankConfidence) tail += share[k++];
    const auto rank =
        std::lower_bound(means.begin(), means.end(), shiftOf(values).interval->low) - means.begin();
    const auto exact = static_cast<double>(k);
    EXPECT_NEAR(static_cast<double>(rank + 1), exact, 0.002 * exact) << count;
  }
}

TEST(Statistics, FrameRatiosWeighByTime) {
  // 1 s of 10 s and 4 s of 8 s, without noise: together 5 of 18
  const RoundTimes times(8, {1.0, 4.0});
  const RoundTimes base(8, {10.0, 8.0});
  const Ratio ratio = pairedRatio(times, base);
  EXPECT_NEAR(ratio.value, 5.0 / 18.0, 1e-12);
  ASSERT_TRUE(ratio.interval);
  // Only as wide as processes of one program differ
  EXPECT_NEAR(ratio.interval->low, 5.0 / 18.0 * std::exp(-kProcessSpread), 1e-12);
  EXPECT_EQ(verdictOf(ratio), TimeVerdict::Faster);
}

// Rounds of two measurements at another speed of the machine; the setting left the first one early.
TEST(Statistics, RoundsOfSeveralMeasurementsArePaired) {
  PairedTimes all;
  all.add(RoundTimes(8, {2.0}), RoundTimes(20, {1.0}));
  all.add(RoundTimes(12, {6.0}), RoundTimes(10, {3.0}));
  const Ratio ratio = pairedRatio(all.times, all.base);
  EXPECT_EQ(ratio.rounds, 18);
  EXPECT_NEAR(ratio.interval->high, 2.0 * std::exp(kProcessSpread), 1e-12);
}

TEST(Statistics, ExchangingTheSettingsGivesTheReciprocal) {
  std::mt19937 random(5);
  std::normal_distribution<double> noise(0.0, 0.2);
  RoundTimes a(8, std::vector<double>(3));
  RoundTimes b = a;
  for (auto* times : {&a, &b})
    for (auto& round : *times)
      for (double& time : round) time = std::exp(noise(random));
  const Ratio forth = pairedRatio(a, b);
  const Ratio back = pairedRatio(b, a);
  EXPECT_NEAR(forth.value * back.value, 1.0, 1e-12);
  EXPECT_NEAR(forth.interval->low * back.interval->high, 1.0, 1e-12);
}

TEST(Statistics, OneDisturbedTimeMovesNothing) {
  RoundTimes times(9, std::vector<double>(4, 2.0));
  const RoundTimes base(9, std::vector<double>(4, 2.0));
  times[3][1] = 50.0;
  const Ratio ratio = pairedRatio(times, base);
  EXPECT_DOUBLE_EQ(ratio.value, 1.0);
  EXPECT_DOUBLE_EQ(ratio.interval->high, std::exp(kProcessSpread));
  EXPECT_EQ(pairedRatio(base, base).interval->high, 1.0);  // beside itself
}

TEST(Statistics, QuotientsOfRatiosAreAsWideAsBoth) {
  const Ratio a{2.0, Interval{1.8, 2.2}, 8, 3};
  const Ratio b{0.5, Interval{0.4, 0.6}, 9, 2};
  const Ratio ratio = quotient(a, b);
  EXPECT_EQ(ratio.value, 4.0);
  EXPECT_EQ(ratio.interval->low, 1.8 / 0.6);
  EXPECT_EQ(ratio.interval->high, 2.2 / 0.4);
  EXPECT_EQ(ratio.rounds, 8);
  EXPECT_EQ(ratio.frames, 2);
  EXPECT_FALSE(quotient(a, {0.5, {}, 9, 2}).interval);
}

TEST(Statistics, TooFewRoundsSaySo) {
  const Ratio ratio = pairedRatio(RoundTimes(7, {1.0}), RoundTimes(7, {2.0}));
  EXPECT_EQ(verdictOf(ratio), TimeVerdict::Unclear);
  EXPECT_EQ(ratioText(ratio), "0.50 (too few rounds to tell)");
}

}  // namespace
}  // namespace catoptric::study
