#include "study/engine.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <set>

#include "core/error.h"

namespace catoptric::study {
namespace {

/// A machine that is slower now and then: a slow drift, another program that comes and goes, and
/// single disturbed frames. Its clock runs by what is rendered.
struct Machine {
  explicit Machine(std::uint32_t seed) : random(seed) {}

  double render(double cost) {
    std::normal_distribution<double> small(0.0, 0.02);
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    const double drift = 1.0 + 0.17 * std::sin(clock / 40.0 + phase);
    if (clock > nextChange) {
      busy = !busy;
      nextChange = clock + (busy ? 3.0 : 9.0) * -std::log(1.0 - unit(random));
    }
    double seconds = cost * drift * (busy ? 1.6 : 1.0) * std::exp(small(random));
    if (unit(random) < 0.08) seconds *= 1.0 + unit(random);
    clock += seconds;
    return seconds;
  }

  std::mt19937 random;
  double clock = 0.0;
  double phase = 0.0;
  double nextChange = 5.0;
  bool busy = false;
};

/// Renders frame n in `cost` times n-dependent seconds of the machine.
class Simulated : public Runner {
 public:
  Simulated(Machine& machine, double cost) : machine_(machine), cost_(cost) {}
  FrameReport render(int frame, const std::filesystem::path& writeTo) override {
    if (frame == failsAt || orders.size() == failsAfter)
      throw Error(ExitCode::FramesFailed, "out of luck");
    orders.push_back(frame);
    if (!writeTo.empty()) written.insert(writeTo.string());
    FrameReport report;
    report.seconds = machine_.render(cost_ * (0.1 + 0.02 * (frame % 3)));
    report.cpuSeconds = report.seconds;
    report.steps = {{"all", report.seconds}};
    return report;
  }
  std::optional<FrameReport> first(int frame, bool again) override {
    if (again) ++starts;
    FrameReport report = render(frame, "");
    report.seconds = report.cpuSeconds = builds + report.cpuSeconds;
    return report;
  }
  int failsAt = 0;
  std::size_t failsAfter = std::numeric_limits<std::size_t>::max();
  double builds = 0.0;
  int starts = 0;
  std::vector<int> orders;
  std::set<std::string> written;

 private:
  Machine& machine_;
  double cost_;
};

/// Also builds for a second of the machine before the first frame.
class SimulatedStarts : public Simulated {
 public:
  SimulatedStarts(Machine& machine, double cost)
      : Simulated(machine, cost), own_(machine), cost_(cost) {}
  std::optional<FrameReport> first(int, bool) override {
    FrameReport report;
    report.seconds = report.cpuSeconds = own_.render(cost_);
    return report;
  }

 private:
  Machine& own_;
  double cost_;
};

struct Trials {
  int holding = 0;  ///< intervals that contain the truth
  int found = 0;    ///< verdicts of the right sign
  int wrong = 0;    ///< of the wrong one
  std::vector<double> off;

  void add(const Ratio& ratio, double truth) {
    if (ratio.interval->low <= truth && truth <= ratio.interval->high) ++holding;
    const TimeVerdict verdict = verdictOf(ratio);
    if (verdict == TimeVerdict::Slower) ++found;
    if (verdict == TimeVerdict::Faster) ++wrong;
    off.push_back(std::abs(ratio.value / truth - 1.0));
  }
};

constexpr int kTrials = 400;

/// Many measurements of two settings with the default number of rounds, the second of them
/// `truth` times as expensive.
template <class Setting = Simulated>
Trials measured(double truth,
                const std::vector<int>& frames = {10, 20, 30, 40, 50, 60, 70, 80, 90, 100},
                FirstFrames first = TurnOptions().first, const TimeKind& kind = {}) {
  Trials trials;
  for (std::uint32_t seed = 1; seed <= kTrials; ++seed) {
    Machine machine(seed);
    machine.phase = seed;
    Setting a(machine, 1.0);
    Setting b(machine, truth);
    TurnOptions options;
    options.seed = seed;
    options.first = first;
    const Measurement result = measureInTurns({&a, &b}, frames, options);
    trials.add(pairedRatio(result.times(1, kind), result.times(0, kind)), truth);
  }
  return trials;
}

TEST(Engine, TheSameSettingTwiceIsNotToldApart) {
  const Trials trials = measured(1.0);
  EXPECT_GE(trials.holding, kTrials * 19 / 20);
  EXPECT_LE(median(trials.off), 0.015);
}

TEST(Engine, FivePercentAreFound) {
  const Trials trials = measured(1.05);
  EXPECT_GE(trials.found, kTrials * 18 / 20);
  EXPECT_GE(trials.holding, kTrials * 19 / 20);
}

TEST(Engine, TwoPercentAreNeverTakenTheWrongWay) {
  const Trials trials = measured(1.02);
  EXPECT_LE(trials.wrong, kTrials / 100);
  EXPECT_GE(trials.found, kTrials / 4);
}

/// One setting after the other on the same machine, what this engine is there to avoid.
TEST(Engine, RunsOneAfterTheOtherAreFarWorse) {
  std::vector<double> off;
  for (std::uint32_t seed = 1; seed <= 20; ++seed) {
    Machine machine(seed);
    machine.phase = seed;
    Simulated a(machine, 1.0);
    Simulated b(machine, 1.0);
    const std::vector<int> frames{10, 20, 30, 40, 50, 60, 70, 80, 90, 100};
    const Measurement first = measureInTurns({&a}, frames, {});
    const Measurement second = measureInTurns({&b}, frames, {});
    off.push_back(std::abs(pairedRatio(second.times(0), first.times(0)).value - 1.0));
  }
  EXPECT_GT(median(off), 2.0 * median(measured(1.0).off));
}

TEST(Engine, EachSettingIsAsOftenBeforeAnotherAsAfterIt) {
  Machine machine(1);
  Simulated a(machine, 1.0);
  Simulated b(machine, 1.0);
  Simulated c(machine, 1.0);
  TurnOptions options;
  options.repeats = 8;
  const Measurement result = measureInTurns({&a, &b, &c}, {1, 2, 3, 4, 5}, options);
  std::map<std::pair<std::size_t, std::size_t>, int> before;
  for (const Turn& one : result.turns)
    for (const Turn& other : result.turns)
      if (one.round == other.round && one.frame == other.frame && one.turn < other.turn)
        ++before[{one.setting, other.setting}];
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < i; ++j) EXPECT_EQ((before[{i, j}]), (before[{j, i}]));
}

TEST(Engine, OnlyTheRoundThatWarmsUpWrites) {
  Machine machine(1);
  Simulated a(machine, 1.0);
  TurnOptions options;
  options.repeats = 2;
  options.writeTo = {"somewhere"};
  const Measurement result = measureInTurns({&a}, {4, 5}, options);
  EXPECT_EQ(a.orders, (std::vector<int>{4, 5, 4, 5, 4, 5}));
  EXPECT_EQ(a.written, std::set<std::string>{"somewhere"});
  EXPECT_EQ(result.turns.size(), 4u);
  EXPECT_EQ(result.settings[0].written.size(), 2u);
}

TEST(Engine, BuildsAreInFirstFramesAndMeansAlone) {
  Machine machine(1);
  Simulated a(machine, 1.0);
  Simulated b(machine, 1.0);
  b.builds = 1.0;
  TurnOptions options;
  const auto kind = [](TimeKind::Of of, int amortize) {
    return TimeKind{Clock::Wall, of, amortize};
  };
  using enum TimeKind::Of;
  options.first = FirstFrames::Once;
  const Measurement once = measureInTurns({&a, &b}, {3, 6, 9}, options);  // of 0.1 s
  EXPECT_EQ(a.starts + b.starts, 0);
  EXPECT_TRUE(once.times(1, kind(First, 1)).empty());
  EXPECT_GT(once.seconds(1, kind(First, 1)), 1.1 * 0.8);
  EXPECT_NEAR(once.seconds(1, {}), once.seconds(0, {}), 0.02);
  const double first = once.seconds(1, kind(First, 1));
  EXPECT_DOUBLE_EQ(once.seconds(1, kind(Mean, 5)), (first + 4.0 * once.seconds(1, {})) / 5.0);

  options.first = FirstFrames::EachRound;
  const Measurement each = measureInTurns({&a, &b}, {3, 6, 9}, options);
  EXPECT_EQ(b.starts, 9);
  EXPECT_EQ(each.times(1).size(), 8u);
  EXPECT_EQ(each.times(1).front().size(), 3u);
  EXPECT_EQ(each.times(1, kind(First, 1)).size(), 8u);
  EXPECT_EQ(each.times(1, kind(Mean, 5)).front().size(), 4u);
  EXPECT_NEAR(each.seconds(1, kind(Mean, 5)),
              (each.seconds(1, kind(First, 5)) + 4.0 * each.seconds(1, {})) / 5.0, 1e-9);
  EXPECT_DOUBLE_EQ(each.seconds(1, kind(Mean, 1)), each.seconds(1, kind(First, 1)));
}

/// The same builds are not told apart, and those that take 20 % longer are mostly found.
TEST(Engine, MeansWithBuildsAreAsSureAsSteadyFrames) {
  const auto trials = [](double truth, const TimeKind& kind) {
    return measured<SimulatedStarts>(truth, {10, 20, 30, 40, 50}, FirstFrames::EachRound, kind);
  };
  for (const auto of : {TimeKind::Of::Mean, TimeKind::Of::First}) {
    const TimeKind kind{Clock::Wall, of, 10};  // builds are half of the mean
    EXPECT_GE(trials(1.0, kind).holding, kTrials * 19 / 20);
    const Trials slower = trials(1.05, kind);
    EXPECT_GE(slower.holding, kTrials * 19 / 20);
    EXPECT_LE(slower.wrong, kTrials / 100);
    EXPECT_GE(trials(1.2, kind).found, kTrials / 2);
  }
}

TEST(Engine, ReflectionAloneIsWithoutWhatAllMethodsShare) {
  Measurement result;
  result.settings.resize(1);
  FrameReport report;
  report.seconds = 1.0;
  report.steps = {{"gbuffer", 0.5}, {"composite", 0.125}, {"trace", 0.25}, {"layers", 0.0625}};
  result.turns = {{1, 0, 0, kFirst, report}, {1, 1, 0, 1, report}};
  const TimeKind kind{Clock::Wall, TimeKind::Of::Reflection};
  EXPECT_EQ(result.times(0, kind), (RoundTimes{{0.3125}}));
  EXPECT_EQ(result.seconds(0, kind), 0.3125);
  EXPECT_EQ(timeName(kind), "reflection alone");
}

TEST(Engine, RoundsOfShortFramesGoOnByTwo) {
  const auto rounds = [](double leastSeconds) {
    Machine machine(1);
    Simulated a(machine, 1.0);
    Simulated b(machine, 1.0);
    TurnOptions options;
    options.leastSeconds = leastSeconds;
    return measureInTurns({&a, &b}, {1, 2}, options).times(0).size();
  };
  EXPECT_EQ(rounds(0.0), 8u);
  EXPECT_EQ(rounds(1.0), 8u);  // a round takes about 0.25 s of each
  EXPECT_GT(rounds(3.0), 8u);
  EXPECT_EQ(rounds(3.0) % 2, 0u);
  EXPECT_EQ(rounds(1e6), 8u * kMostLonger);
}

TEST(Engine, ProgressKnowsEarlyThatShortFramesAreUnclear) {
  Machine machine(1);
  Simulated a(machine, 1.0);
  TurnOptions options;
  options.leastSeconds = 3.0;  // more than 8 rounds
  options.mostSeconds = 1e6;
  options.growth = [](const Measurement&) { return std::vector{100.0}; };
  options.progress = [](int done, int all) {
    if (done >= 9) {
      EXPECT_EQ(all, 1 + 8 * kMostLonger);
    }
  };
  measureInTurns({&a}, {1}, options);
}

TEST(Engine, RoundsGoOnUntilTheyAreEnough) {
  const auto rounds = [](double mostSeconds, std::size_t turns) {
    Machine machine(1);
    Simulated a(machine, 1.0);
    TurnOptions options;
    options.mostSeconds = mostSeconds;
    options.growth = [turns](const Measurement& so) {
      return std::vector{static_cast<double>(turns) / static_cast<double>(so.turns.size())};
    };
    int shown = 0;
    bool ended = false;
    options.progress = [&](int done, int all) {
      EXPECT_EQ(done, shown++);
      EXPECT_LE(done, all);
      EXPECT_FALSE(ended) << "goes on after it said that all is done";
      ended = done == all;
      if (mostSeconds > 0.0 && turns == 40 && done >= 9 * 2) {
        EXPECT_EQ(all, 21 * 2);  // known from round 8 on
      }
    };
    const std::size_t count = measureInTurns({&a}, {1, 2}, options).times(0).size();
    EXPECT_TRUE(ended);
    return count;
  };
  EXPECT_EQ(rounds(1e6, 10), 8u);
  EXPECT_EQ(rounds(1e6, 40), 20u);  // of two frames
  EXPECT_EQ(rounds(0.0, 40), 8u);
}

TEST(Engine, ManyRoundsAreNotJudgedAfterEachPair) {
  Machine machine(1);
  Simulated a(machine, 1.0);
  TurnOptions options;
  options.repeats = 100;
  options.mostSeconds = 1e6;
  int judged = 0;
  options.growth = [&](const Measurement&) {
    ++judged;
    return std::vector{2.0};
  };
  EXPECT_EQ(measureInTurns({&a}, {1}, options).times(0).size(), 100u * kMostLonger);
  EXPECT_LE(judged, 20);
}

TEST(Engine, ProgressCountsTheTurnsThatAreTaken) {
  Machine machine(1);
  std::vector<Simulated> settings(4, {machine, 1.0});
  settings[3].failsAt = 1;
  TurnOptions options;
  options.mostSeconds = 1e6;
  options.growth = [](const Measurement& so) {
    const auto rounds = static_cast<double>(so.times(2).size());
    return std::vector{10.0 / rounds, 8.0 / rounds, 40.0 / rounds, 0.0};
  };
  const int warmUp = 3 * 2 + 1;  // two frames; the last setting fails at the first
  const int ofEight = warmUp + 3 * 2 * 8;
  const int ofAll = ofEight + 2 * 2 + 2 * 32;
  int shown = 0;
  options.progress = [&](int done, int all) {
    EXPECT_EQ(done, shown++);
    if (done >= warmUp) {
      EXPECT_EQ(all, done < ofEight ? ofEight : ofAll);
    }
  };
  measureInTurns({&settings[0], &settings[1], &settings[2], &settings[3]}, {1, 2}, options);
  EXPECT_EQ(shown, ofAll + 1);
}

/// Settings leave when their ratios to all others are clear. Rounds that end by the interval's
/// width leave 95 % of the intervals around the truth.
TEST(Engine, ClearSettingsLeaveAndIntervalsStayHonest) {
  const std::vector<double> truths{1.0, 1.0, 1.02, 1.15, 1.4, 3.0, 3.1};
  std::map<std::pair<std::size_t, std::size_t>, Trials> trials;
  std::vector<double> rounds(truths.size());
  for (std::uint32_t seed = 1; seed <= kTrials; ++seed) {
    Machine machine(seed);
    machine.phase = seed;
    std::vector<Simulated> settings;
    for (const double truth : truths) settings.emplace_back(machine, 0.25 * truth);
    std::vector<Runner*> runners;
    for (Simulated& setting : settings) runners.push_back(&setting);
    TurnOptions options;
    options.seed = seed;
    options.mostSeconds = 12.0;
    options.growth = [](const Measurement& so) { return growthOf(so, {}); };
    const Measurement result = measureInTurns(runners, {1, 2, 3, 4}, options);
    for (std::size_t i = 0; i < truths.size(); ++i) {
      rounds[i] += static_cast<double>(result.times(i).size()) / kTrials;
      for (std::size_t j = 0; j < i; ++j)
        trials[{i, j}].add(pairedRatio(result.times(i), result.times(j)), truths[i] / truths[j]);
    }
  }
  for (const auto& [pair, of] : trials) {
    const double truth = truths[pair.first] / truths[pair.second];
    EXPECT_GE(of.holding, kTrials * 19 / 20) << truth;
    EXPECT_LE(truth > 1.0 ? of.wrong : 0, kTrials / 100) << truth;
    EXPECT_GE(truth > 1.03 ? of.found : kTrials, kTrials * 19 / 20) << truth;
  }
  EXPECT_GE(rounds[2], 16.0);
  EXPECT_LE(rounds[4], 0.7 * rounds[2]);  // far from all others
}

/// Ratios to its successor are clear by then, also to one that has left before.
TEST(Engine, TheFirstMayFailAfterOthersLeft) {
  for (std::uint32_t seed = 1; seed <= 50; ++seed) {
    Machine machine(seed);
    machine.phase = seed;
    Simulated a(machine, 0.25);
    Simulated b(machine, 0.35);
    Simulated c(machine, 0.25);
    a.failsAfter = 4 * 13;  // in round 13
    TurnOptions options;
    options.seed = seed;
    options.mostSeconds = 12.0;
    options.growth = [](const Measurement& so) { return growthOf(so, {}); };
    const Measurement result = measureInTurns({&a, &b, &c}, {1, 2, 3, 4}, options);
    if (result.settings[0].failure.empty()) continue;  // clear before
    const Ratio ratio = pairedRatio(result.times(2), result.times(1));
    EXPECT_LE(ratio.interval->high / ratio.interval->low, 1.1) << seed;
    EXPECT_LE(result.times(2).size(), std::max(result.times(1).size(), std::size_t{14})) << seed;
  }
}

TEST(Engine, RoundsAreEnoughForTheTimeThatCounts) {
  // Of two settings first frames differ from round to round, or wall-clock times, or nothing
  const auto growth = [](double first, double wall, const TimeKind& kind) {
    Measurement so;
    so.settings.resize(2);
    for (int round = 1; round <= 12; ++round)
      for (const std::size_t setting : {0, 1})
        for (const int frame : {kFirst, 1}) {
          const double noise = setting == 0 ? 0.0 : std::sin(7.0 * round);
          FrameReport report;
          report.cpuSeconds = 1.0 + (frame == kFirst ? first * noise : 0.0);
          report.seconds = report.cpuSeconds + wall * noise;
          so.turns.push_back({round, 0, setting, frame, report});
        }
    return growthOf(so, kind)[1];
  };
  using enum TimeKind::Of;
  EXPECT_LE(growth(0.2, 0.0, {Clock::Wall, Steady}), 1.0);
  EXPECT_GT(growth(0.2, 0.0, {Clock::Wall, First}), 1.0);
  EXPECT_GT(growth(0.2, 0.0, {Clock::Wall, Mean, 2}), 1.0);
  EXPECT_LE(growth(0.2, 0.0, {Clock::Wall, Mean, 900}), 1.0);
  EXPECT_GT(growth(0.0, 0.2, {Clock::Wall, Steady}), 1.0);
  EXPECT_LE(growth(0.0, 0.2, {Clock::Cpu, Steady}), 1.0);
}

TEST(Engine, OneThatFailsLeavesTheOthers) {
  Machine machine(1);
  Simulated a(machine, 1.0);
  Simulated b(machine, 1.0);
  b.failsAt = 5;
  const Measurement result = measureInTurns({&a, &b}, {4, 5}, {});
  EXPECT_EQ(result.settings[1].failure, "out of luck");
  EXPECT_EQ(result.times(0).size(), 8u);
  EXPECT_TRUE(result.times(1).empty());
}

TEST(Engine, WithoutTimeWholeRoundsAreKept) {
  for (const std::size_t frames : {3, 4, 5, 11, 12, 13}) {
    Machine machine(1);
    Simulated a(machine, 1.0);
    Simulated b(machine, 1.0);
    TurnOptions options;
    options.outOfTime = [&] { return a.orders.size() + b.orders.size() >= frames; };
    const Measurement result = measureInTurns({&a, &b}, {1, 2}, options);
    EXPECT_FALSE(result.stopped);
    EXPECT_EQ(a.orders.size() + b.orders.size(), frames);
    EXPECT_EQ(result.turns.size(), (frames / 4 - (frames < 4 ? 0 : 1)) * 4) << frames;
    EXPECT_EQ(result.times(0).size(), result.times(1).size());
  }
}

TEST(Engine, StopsBetweenFrames) {
  Machine machine(1);
  Simulated a(machine, 1.0);
  TurnOptions options;
  options.stopRequested = [&] { return a.orders.size() == 3; };
  EXPECT_TRUE(measureInTurns({&a}, {1, 2}, options).stopped);
  EXPECT_EQ(a.orders.size(), 3u);
}

}  // namespace
}  // namespace catoptric::study
