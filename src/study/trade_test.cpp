#include "study/trade.h"

#include <gtest/gtest.h>

#include <limits>

namespace catoptric::study {
namespace {

/// Settings with known times; each ratio is known up to `width` on both sides.
std::vector<Judged> judged(const std::vector<double>& errors, const std::vector<double>& times,
                           double width, double uncertainty = 0.0) {
  return judge(errors, uncertainty, [&](std::size_t a, std::size_t b) {
    const double value = times[a] / times[b];
    return Ratio{value, Interval{value / (1.0 + width), value * (1.0 + width)}, 6, 1};
  });
}

TEST(Trade, SlowerAndLessAccurateIsDominated) {
  const auto result = judged({1.0, 2.0, 3.0}, {3.0, 1.0, 2.0}, 0.01);
  EXPECT_EQ(result[0].mark, Mark::Front);
  EXPECT_EQ(result[1].mark, Mark::Front);
  EXPECT_EQ(result[2].mark, Mark::Dominated);
  EXPECT_EQ(result[2].by, 1);
}

TEST(Trade, TimesThatCannotBeToldApartAreUnclear) {
  // The second is less accurate, and 1 % faster or slower: nobody knows.
  const auto result = judged({1.0, 2.0}, {1.0, 0.99}, 0.05);
  EXPECT_EQ(result[0].mark, Mark::Front);
  EXPECT_EQ(result[1].mark, Mark::Unclear);
  EXPECT_EQ(result[1].by, 0);
}

TEST(Trade, EqualPixelsAndUnclearTimesAreBothUnclear) {
  const auto result = judged({1.0, 1.0}, {1.0, 1.01}, 0.05);
  EXPECT_EQ(result[0].mark, Mark::Unclear);
  EXPECT_EQ(result[1].mark, Mark::Unclear);
}

TEST(Trade, WithoutAnIntervalNothingIsDominated) {
  const auto result = judge({1.0, 2.0}, 0.0, [](std::size_t a, std::size_t b) {
    return Ratio{a == b ? 1.0 : 0.1, {}, 3, 1};
  });
  EXPECT_EQ(result[1].mark, Mark::Unclear);
}

TEST(Trade, WhatIsMoreExactThanTheReferenceIsNotDominated) {
  // 0.1, 0.2 and 0.3 against a reference that is off by 0.25: the first two may be in any order.
  const auto result = judged({0.2, 0.1, 0.3}, {2.0, 1.0, 3.0}, 0.01, 0.25);
  EXPECT_EQ(result[0].mark, Mark::Unclear);
  EXPECT_EQ(result[0].by, 1);
  EXPECT_EQ(result[1].mark, Mark::Front);
  EXPECT_EQ(result[2].mark, Mark::Dominated);
  // The slower of two with different errors is unclear whichever error is less, with equal ones
  // it is dominated.
  EXPECT_EQ(judged({0.1, 0.2}, {2.0, 1.0}, 0.01, 0.25)[0].mark, Mark::Unclear);
  EXPECT_EQ(judged({0.1, 0.1}, {2.0, 1.0}, 0.01, 0.25)[0].mark, Mark::Dominated);
}

TEST(Trade, WithoutAnErrorItIsUnmeasured) {
  const auto result = judged({std::numeric_limits<double>::quiet_NaN(), 2.0}, {1.0, 2.0}, 0.01);
  EXPECT_EQ(result[0].mark, Mark::Unmeasured);
  EXPECT_EQ(result[1].mark, Mark::Front);
}

}  // namespace
}  // namespace catoptric::study
