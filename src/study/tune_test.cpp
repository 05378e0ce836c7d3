#include "study/tune.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <climits>
#include <cmath>
#include <string>

#include "core/error.h"

namespace catoptric::study {
namespace {

using testing::HasSubstr;

/// A method with three options of 6 values each: time and error are known, and not simply products.
struct World : TuneWorld {
  World() {
    for (int a = 0; a < 6; ++a)
      for (int b = 0; b < 6; ++b)
        for (int c = 0; c < 6; ++c) candidates.push_back({0, {a, b, c}});
    for (int frame = 1; frame <= 900; ++frame) frames.push_back(frame);
  }
  double seconds(std::size_t i) const {
    const std::vector<int>& v = candidates[i].values;
    return 0.02 + 0.01 * std::pow(1.5, v[0]) + 0.004 * v[1] * (1.0 + 0.2 * v[0]) + 0.002 * v[2];
  }
  double error(std::size_t i, int frame) const {
    const std::vector<int>& v = candidates[i].values;
    const double all = 6.0 * std::pow(0.7, v[0]) + 2.0 * std::pow(0.6, v[1]) + 0.3 * (5 - v[2]) / 5;
    return all * (frame == hardFrame ? 1.5 : 1.0 + 0.05 * std::sin(frame));
  }
  std::vector<double> errors(std::size_t i, const std::vector<int>& of) override {
    std::vector<double> result;
    for (const int frame : of) result.push_back(error(i, frame));
    rendered += static_cast<int>(of.size());
    return result;
  }
  double pooled(std::size_t i, const std::vector<int>& of) override {
    double sum = 0.0;
    for (const int frame : of) sum += error(i, frame);
    return sum / static_cast<double>(of.size());
  }
  std::map<std::size_t, MeasuredTime> times(const std::vector<std::size_t>& of,
                                            const std::vector<int>& ofFrames,
                                            int measurements) override {
    std::map<std::size_t, MeasuredTime> result;
    for (const std::size_t i : of) {
      // Off by up to a third of the interval, by the candidate's number.
      const double width = intervalWidth / std::sqrt(measurements);
      const double ratio =
          seconds(i) / 0.1 * (1.0 + width * std::sin(17.0 * static_cast<double>(i)) / 3.0);
      result[i] = {0.1 * ratio,
                   {ratio, Interval{(1.0 - width) * ratio, (1.0 + width) * ratio}, 8, 16}};
      rendered += 9 * static_cast<int>(ofFrames.size());
    }
    return result;
  }
  /// The best of all combinations.
  double bestSeconds(double limit, bool everyFrame) const {
    double best = INFINITY;
    for (std::size_t i = 0; i < candidates.size(); ++i) {
      double sum = 0.0;
      double most = 0.0;
      for (const int frame : frames) {
        sum += error(i, frame);
        most = std::max(most, error(i, frame));
      }
      if ((everyFrame ? most : sum / 900.0) <= limit) best = std::min(best, seconds(i));
    }
    return best;
  }
  std::vector<Candidate> candidates;
  std::vector<int> frames;
  int hardFrame = 0;
  double intervalWidth = 0.0;
  int rendered = 0;
};

TuneOptions optionsFor(const World& world, const Bound& bound) {
  TuneOptions options;
  options.bound = bound;
  options.frames = world.frames;
  return options;
}

TEST(Tune, EndsNearTheBestOfTheGridForAFifthOfItsFrames) {
  World world;
  const TuneResult result =
      tune(world.candidates, world, optionsFor(world, parseMaxError("L1_8bit<=2")));
  ASSERT_TRUE(result.best);
  EXPECT_TRUE(result.verifiedOnAll);
  EXPECT_LE(result.error, 2.0);
  EXPECT_LE(world.seconds(*result.best), 1.1 * world.bestSeconds(2.0, false));
  EXPECT_LE(world.rendered, 216 * 900 / 5);
}

TEST(Tune, AHardFrameThatNobodyLookedAtIsFound) {
  World world;
  world.hardFrame = 333;
  const TuneResult result =
      tune(world.candidates, world, optionsFor(world, parseMaxError("L1_8bit<=2 every-frame")));
  ASSERT_TRUE(result.best);
  EXPECT_LE(world.error(*result.best, 333), 2.0);
  EXPECT_EQ(result.worstFrame, 333);
  EXPECT_LE(world.seconds(*result.best), 1.1 * world.bestSeconds(2.0, true));
}

TEST(Tune, OfATimeTheMostAccurateHolds) {
  for (const double width : {0.02, 0.1, 0.2})
    for (const double limit : {0.4, 0.5, 0.6, 0.8, 1.2}) {
      World world;
      world.intervalWidth = width;
      TuneOptions options = optionsFor(world, parseMaxTime("1x:traced"));
      options.bound.limit = limit;
      options.margin = 0.05;
      const TuneResult result = tune(world.candidates, world, options);
      ASSERT_TRUE(result.best) << width << " " << limit;
      EXPECT_LE(world.seconds(*result.best), 0.1 * limit);
      // The best of what can be told to be within the limit
      double best = INFINITY;
      for (std::size_t i = 0; i < world.candidates.size(); ++i)
        if (world.seconds(i) * (1.0 + width) <= 0.1 * limit)
          best = std::min(best, world.pooled(i, world.frames));
      EXPECT_LE(result.error, 1.1 * best) << width << " " << limit;
      EXPECT_LE(world.rendered, 216 * 900 / 5);
    }
}

TEST(Tune, ATimeThatNothingHasNamesTheFastest) {
  World world;
  const TuneResult result =
      tune(world.candidates, world, optionsFor(world, parseMaxTime("0.2x:traced")));
  EXPECT_FALSE(result.best);
  ASSERT_TRUE(result.nearest);
  EXPECT_EQ(world.candidates[*result.nearest].values, (std::vector<int>{0, 0, 0}));
}

TEST(Tune, ATimeTooNearToItsBoundIsUndecided) {
  // One setting, faster than the bound by a hundredth, of times that are known to a fifth: to an
  // eighth by all measurements that are made of it
  for (const bool near : {true, false}) {
    const std::string verdict = near ? "undecided" : "holds";
    World world;
    world.candidates.resize(1);
    world.intervalWidth = near ? 0.2 : 0.005;
    TuneOptions options = optionsFor(world, parseMaxTime("1x:traced"));
    options.bound.limit = 1.01 * world.seconds(0) / 0.1;
    const TuneResult result = tune(world.candidates, world, options);
    EXPECT_EQ(result.best.has_value(), !near);
    EXPECT_TRUE(std::ranges::any_of(result.trials, [&](const Trial& trial) {
      return trial.verdict == verdict;
    })) << verdict;
  }
}

TEST(Tune, WhatCannotBeHadNamesTheNearest) {
  World world;
  const TuneResult result =
      tune(world.candidates, world, optionsFor(world, parseMaxError("L1_8bit<=0.1")));
  EXPECT_FALSE(result.best);
  ASSERT_TRUE(result.nearest);
  EXPECT_EQ(world.candidates[*result.nearest].values, (std::vector<int>{5, 5, 5}));
}

TEST(Tune, AnOptionWithoutEffectIsProposedInOneValueAlone) {
  World world;
  std::vector<Candidate> all;
  for (const Candidate& one : world.candidates)
    for (int d = 0; d < 3; ++d) {
      all.push_back(one);
      all.back().values.push_back(d);
    }
  world.candidates = all;
  const TuneResult result =
      tune(world.candidates, world, optionsFor(world, parseMaxError("L1_8bit<=2")));
  ASSERT_TRUE(result.best);
  EXPECT_LE(world.seconds(*result.best), 1.1 * world.bestSeconds(2.0, false));
  int without = 0;
  for (const Trial& trial : result.trials) {
    if (trial.verdict == "no effect") ++without;
    if (trial.stage == "screen") continue;
    EXPECT_EQ(world.candidates[trial.candidate].values[3], 1);
  }
  EXPECT_EQ(without, 2);
}

TEST(Tune, TheSameSeedGivesTheSameProposals) {
  std::vector<std::string> texts;
  for (int i = 0; i < 2; ++i) {
    World world;
    TuneOptions options = optionsFor(world, parseMaxError("L1_8bit<=2"));
    options.seed = 7;
    std::string text;
    for (const Trial& trial : tune(world.candidates, world, options).trials)
      text += trial.stage + std::to_string(trial.candidate) + " ";
    texts.push_back(text);
  }
  EXPECT_EQ(texts[0], texts[1]);
}

/// The time is over after some frames.
struct ShortOfTime : World {
  bool outOfTime() const override { return rendered >= most; }
  std::vector<double> errors(std::size_t i, const std::vector<int>& of) override {
    std::vector<double> result;
    for (const int frame : of) {
      if (outOfTime()) return {};
      result.push_back(error(i, frame));
      known[i].push_back(frame);
      ++rendered;
    }
    return result;
  }
  double errorSoFar(std::size_t i) override {
    return known.contains(i) ? pooled(i, known[i]) : NAN;
  }
  std::map<std::size_t, MeasuredTime> times(const std::vector<std::size_t>& of,
                                            const std::vector<int>& ofFrames,
                                            int measurements) override {
    std::map<std::size_t, MeasuredTime> result;
    for (const std::size_t i : of)
      if (!outOfTime()) result.merge(World::times({i}, ofFrames, measurements));
    if (ofFrames.size() == kRaced && result.size() < of.size()) raceWasCutShort = true;
    return result;
  }
  static constexpr std::size_t kRaced = 16;
  int most = INT_MAX;
  std::map<std::size_t, std::vector<int>> known;
  bool raceWasCutShort = false;
};

TEST(Tune, WhereverTheTimeEndsResultsAreOfWhatWasMeasured) {
  for (const Bound& bound : {parseMaxError("L1_8bit<=2"), parseMaxTime("0.6x:traced")}) {
    const bool byError = bound.kind == Bound::Kind::Error;
    ShortOfTime whole;
    whole.intervalWidth = 0.02;
    ASSERT_TRUE(tune(whole.candidates, whole, optionsFor(whole, bound)).best);
    int racesCutShort = 0;
    for (int most = 1; most < whole.rendered; most += whole.rendered / 100) {
      ShortOfTime world;
      world.intervalWidth = 0.02;
      world.most = most;
      const TuneResult result = tune(world.candidates, world, optionsFor(world, bound));
      SCOPED_TRACE(bound.text + " " + std::to_string(most));
      EXPECT_TRUE(result.outOfTime);
      EXPECT_TRUE(result.best || result.nearest);
      for (const Trial& trial : result.trials)
        if (trial.stage == "race") {
          EXPECT_TRUE(std::isfinite(trial.error) && std::isfinite(trial.seconds));
        }
      if (world.raceWasCutShort) ++racesCutShort;
      if (!result.best) continue;
      EXPECT_TRUE(result.verifiedOnAll);
      EXPECT_LE(byError ? world.pooled(*result.best, world.frames) : world.seconds(*result.best),
                byError ? 2.0 : 0.06);
    }
    EXPECT_GT(racesCutShort, 0) << bound.text;
  }
}

TEST(Tune, BoundsAreChecked) {
  const auto messageOf = [](const std::function<void()>& body) -> std::string {
    try {
      body();
    } catch (const UsageError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_THAT(messageOf([] { parseMaxError("L1_8bt<=2"); }),
              HasSubstr("did you mean \"L1_8bit\"?"));
  EXPECT_THAT(messageOf([] { parseMaxError("L1_8bit=2"); }), HasSubstr("MEASURE<=LIMIT"));
  EXPECT_THAT(messageOf([] { parseMaxError("L1_8bit<=-1"); }), HasSubstr("below 0"));
  EXPECT_THAT(messageOf([] { parseMaxError("L1_8bit<=2 often"); }), HasSubstr("every-frame, mean"));
  EXPECT_THAT(messageOf([] { parseMaxTime("fast"); }), HasSubstr("must be a time"));
  EXPECT_THAT(messageOf([] { parseMaxTime("0ms"); }), HasSubstr("must be above 0"));
  EXPECT_EQ(parseMaxTime("0.8x:traced").timeOf, "traced");
  EXPECT_DOUBLE_EQ(parseMaxTime("100ms").limit, 0.1);
}

}  // namespace
}  // namespace catoptric::study
