#include "nightly/judge.h"

#include <gtest/gtest.h>

#include <cmath>

#include "nightly/junit.h"
#include "nightly/night.h"

namespace catoptric::nightly {
namespace {

TEST(Judge, SignedRanksAreExact) {
  // 3 values: 8 choices of signs; the ranks add up to 6, 5, 4, 3 (twice), 2, 1, 0
  EXPECT_DOUBLE_EQ(signedRankP({1.0, 2.0, 3.0}), 1.0 / 8.0);
  EXPECT_DOUBLE_EQ(signedRankP({-1.0, 2.0, 3.0}), 2.0 / 8.0);
  EXPECT_DOUBLE_EQ(signedRankP({1.0, 2.0, -3.0}), 5.0 / 8.0);
  EXPECT_DOUBLE_EQ(signedRankP({-1.0, -2.0, -3.0}), 1.0);
  EXPECT_DOUBLE_EQ(signedRankP({}), 1.0);
}

TEST(Judge, FalseDiscoveriesAreThoseOfTheProcedure) {
  // Benjamini and Hochberg's own example: of 15 tests the first 4 are called at 5 %
  const std::vector<double> p = {0.0001, 0.0004, 0.0019, 0.0095, 0.0201, 0.0278, 0.0298, 0.0344,
                                 0.0459, 0.3240, 0.4262, 0.5719, 0.6528, 0.7590, 1.0};
  const std::vector<bool> called = falseDiscoveries(p, 0.05);
  for (std::size_t i = 0; i < p.size(); ++i) EXPECT_EQ(called[i], i < 4) << i;
  EXPECT_TRUE(falseDiscoveries({}, 0.05).empty());
}

TEST(Judge, ChangePointsAreTheLevels) {
  EXPECT_TRUE(changePoints({0.0, 0.004, -0.003, 0.002, 0.0}, 0.015).empty());
  EXPECT_EQ(changePoints({0.0, 0.002, 0.08, 0.081, 0.079}, 0.015), (std::vector<std::size_t>{2}));
  EXPECT_EQ(changePoints({0.0, 0.002, 0.001, 0.03, 0.06, 0.09}, 0.015),
            (std::vector<std::size_t>{3, 4, 5}));
}

TEST(Judge, ATimeIsJudgedByItsWholeInterval) {
  const auto state = [](double low, double high) {
    return stateOf({0.5 * (low + high), study::Interval{low, high}}, 0.05);
  };
  EXPECT_EQ(state(1.051, 1.2), TimeState::Fails);
  EXPECT_EQ(state(1.049, 1.2), TimeState::Undecided);
  EXPECT_EQ(state(0.9, 1.051), TimeState::Undecided);
  EXPECT_EQ(state(0.9, 1.049), TimeState::Holds);
  EXPECT_EQ(stateOf({1.2, {}}, 0.05), TimeState::Undecided);
}

TEST(Judge, ALongerTimeMustBeLongerInFreshProcesses) {
  CaseFacts facts;
  const auto add = [&](int attempt, double ratio) {
    study::RoundTimes base;
    study::RoundTimes times;
    for (int round = 0; round < 8; ++round) {
      base.push_back({1.0 + 0.001 * round});
      times.push_back({ratio * base.back()[0] * (1.0 + 0.001 * (round % 3))});
    }
    facts.timings.push_back({role::kAccepted, attempt, "a", base});
    facts.timings.push_back({role::kTonight, attempt, "b", times});
  };
  const auto judged = [&] { return confirmedRatio(facts, role::kAccepted, 0.05); };
  EXPECT_FALSE(judged());
  add(1, 1.2);
  EXPECT_EQ(judged()->state, TimeState::Undecided);
  add(2, 1.1);
  EXPECT_EQ(judged()->state, TimeState::Fails);
  EXPECT_NEAR(judged()->ratio.value, 1.1, 0.002);  // the one nearer to the gate
  facts.timings.resize(2);
  add(2, 1.0);
  EXPECT_EQ(judged()->state, TimeState::Holds);
  facts.timings.clear();
  add(1, 1.0);
  EXPECT_EQ(judged()->state, TimeState::Holds);
}

TEST(Judge, PicturesOverALimitAreChangedOrImproved) {
  const Gates gates;
  EXPECT_EQ(judgePicture({{"L1_8bit", 0.01}, {"max_8bit", 1.0}}, gates, {}).status, "within");
  const PictureState changed = judgePicture({{"worst_reflector", 1.0}}, gates, {});
  EXPECT_EQ(changed.status, "changed");
  EXPECT_EQ(changed.value, 1.0);
  EXPECT_EQ(judgePicture({{"L1_8bit", 3.0}}, gates, std::pair(1.0, 4.0)).status, "improved");
  EXPECT_EQ(judgePicture({{"L1_8bit", 3.0}}, gates, std::pair(4.0, 1.0)).status, "changed");
  // By less than 2 % it is none.
  EXPECT_EQ(judgePicture({{"L1_8bit", 3.0}}, gates, std::pair(3.91, 4.0)).status, "improved");
  EXPECT_EQ(judgePicture({{"L1_8bit", 3.0}}, gates, std::pair(3.93, 4.0)).status, "changed");
  for (const auto& [name, limit] : gates.picture) {
    EXPECT_EQ(judgePicture({{name, 0.99 * limit}}, gates, {}).status, "within") << name;
    EXPECT_EQ(judgePicture({{name, 1.01 * limit}}, gates, {}).status, "changed") << name;
  }
}

TEST(Judge, CountersMayFallButNotRise) {
  const Gates gates;
  EXPECT_TRUE(worseCounters({{"refused", 2}}, {{"refused", 2}}, {"refused"}, gates).empty());
  EXPECT_EQ(worseCounters({{"refused", 3}}, {{"refused", 2}}, {"refused"}, gates).size(), 1u);
  EXPECT_EQ(worseCounters({{"refused", 1}}, {}, {"refused"}, gates).size(), 1u);
  EXPECT_TRUE(worseCounters({{"unclustered", 110}}, {{"unclustered", 100}}, {}, gates).empty());
  EXPECT_EQ(worseCounters({{"unclustered", 111}}, {{"unclustered", 100}}, {}, gates).size(), 1u);
  EXPECT_TRUE(worseCounters({{"rays", 200}}, {{"rays", 100}}, {}, gates).empty());
}

TEST(Gates, AreReadInPercent) {
  std::string text =
      R"({"time": 1, "memory": 2, "disk": 3, "again": 4, "watch_rise": 5, "flicker": 7,
      "watch": ["rays"])";
  for (const auto& [name, limit] : Gates().picture) text += ", \"" + name + "\": 6";
  const config::Value value = config::parseText(text + "}", "gates");
  EXPECT_TRUE(config::check(value, gatesSchema()).empty());
  Gates gates = readGates(value);
  const auto& [time, memory, disk, flicker, again, picture, watch, watchRise] = gates;
  EXPECT_EQ((std::vector<double>{time, memory, disk, again, watchRise, flicker}),
            (std::vector<double>{0.01, 0.02, 0.03, 0.04, 0.05, 7.0}));
  EXPECT_EQ(watch, std::vector<std::string>{"rays"});
  for (const auto& [name, limit] : picture) EXPECT_EQ(limit, 6.0) << name;
}

TEST(Judge, JUnitEscapesAndCounts) {
  Night night;
  night.suite = "own";
  night.started = "2026-01-01T00:00:00Z";
  Verdict bad;
  bad.name = "own.box.m";
  bad.kind = "picture";
  bad.status = "changed";
  bad.outcome = Outcome::Regression;
  bad.frame = 3;
  bad.began = 2;
  bad.message = "a < b \"and\" \x01 & more";
  Verdict second = bad;
  second.frame = 4;
  Verdict good;
  good.name = "own.box.m";
  good.kind = "time";
  const std::string xml = junitXml(night, {bad, second, good});
  EXPECT_NE(xml.find("tests=\"2\" failures=\"1\" errors=\"0\" skipped=\"0\""), std::string::npos)
      << xml;
  EXPECT_EQ(xml.find('\x01'), std::string::npos);
  EXPECT_NE(xml.find("a &lt; b"), std::string::npos);
  EXPECT_NE(xml.find("since night 2"), std::string::npos);
}

}  // namespace
}  // namespace catoptric::nightly
