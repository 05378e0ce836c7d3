// Twenty nights of a project's life: what is wrong is found and named with the night that it began
// with, and what is not is left alone, although other programs use the machine. NIGHTLY_SEED=N
// gives other machines and programs.
#include <SQLiteCpp/SQLiteCpp.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>

#include "nightly/accept.h"
#include "nightly/open_night.h"
#include "nightly/page.h"
#include "nightly/summary.h"
#include "nightly/test_lab.h"

namespace catoptric::nightly {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class Nights : public testing::Test {
 protected:
  Nights() {
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    folder = fs::path(testing::TempDir()) /
             ("nights_" + std::string(info->name()) + "_" + std::to_string(::getpid()));
    fs::remove_all(folder);
    fs::create_directories(folder / "programs");
    suite.name = "own";
    suite.title = "Own";
    for (const char* name : {"a", "b", "c", "d", "e", "f", "g", "h"}) addScene(name);
    history = std::make_unique<History>(folder / "history.db", History::Mode::Create);
  }
  ~Nights() override {
    history.reset();
    fs::remove_all(folder);
  }

  void addScene(const std::string& name) {
    NightScene scene;
    scene.name = name;
    scene.frames = {{"full", "1-8"}};
    suite.scenes.push_back(scene);
  }

  NightScene& scene(const std::string& name) {
    return *std::ranges::find_if(suite.scenes, [&](const auto& one) { return one.name == name; });
  }

  /// The next night, of the next build, with what is wrong with it.
  std::vector<Verdict> night(const Build& build) {
    const int number = ++nights;
    const std::string name = "b" + std::to_string(100 + number);
    builds[name] = build;
    std::ofstream(folder / "programs" / name) << name;
    lab.machine.random.seed(static_cast<unsigned>(1000 * seed + number));
    const Night wanted{0,  "own", "p", "full", "machine", name, "1.0", "2026-01-01T00:00:00Z",
                       "", false};
    const OpenNight open(*history, wanted);
    NightOptions options;
    options.baseline = baseline;
    options.program = folder / "programs" / name;
    keepProgram(*history, options.program, name);
    measureNight(*history, open.night(), casesOf(suite, "full", {}, lab), suite.gates, lab,
                 options);
    return judgeNight(*history, open.night(), suite.gates, {"refused"});
  }

  static std::vector<Verdict> of(const std::vector<Verdict>& verdicts, const std::string& scene,
                                 const std::string& kind) {
    std::vector<Verdict> all;
    for (const Verdict& verdict : verdicts)
      if (verdict.name == "own." + scene + ".m" && verdict.kind == kind) all.push_back(verdict);
    return all;
  }
  static std::string statusOf(const std::vector<Verdict>& verdicts, const std::string& scene,
                              const std::string& kind) {
    const std::vector<Verdict> all = of(verdicts, scene, kind);
    return all.empty() ? "" : all.back().status;
  }
  static std::string failures(const std::vector<Verdict>& verdicts) {
    std::string text;
    for (const Verdict& verdict : verdicts)
      if (outcomeOf(verdict) == Outcome::Regression || outcomeOf(verdict) == Outcome::Crash)
        text +=
            verdict.name + " " + verdict.kind + " " + verdict.status + " " + verdict.message + "\n";
    return text;
  }

  fs::path folder;
  NightSuite suite;
  std::map<std::string, Build> builds;
  TestLab lab{builds};
  std::unique_ptr<History> history;
  int nights = 0;
  int seed = std::getenv("NIGHTLY_SEED") != nullptr ? std::atoi(std::getenv("NIGHTLY_SEED")) : 1;
  std::string baseline = role::kAccepted;
};

TEST_F(Nights, TwentyWithoutFaultsAlarmNobody) {
  int isVoid = 0;
  int undecided = 0;
  for (int i = 0; i < 20; ++i) {
    const std::vector<Verdict> verdicts = night({});
    if (i == 0) acceptVerdicts(*history, {{"*"}, "first", "tester"});
    EXPECT_EQ(failures(verdicts), "") << "night " << i + 1;
    for (const Verdict& verdict : verdicts) {
      isVoid += verdict.status == "void" ? 1 : 0;
      undecided += verdict.status == "undecided" ? 1 : 0;
    }
  }
  std::printf("void: %d, undecided: %d of %d\n", isVoid, undecided, 19 * 8 * 2 - 8);
  EXPECT_LE(isVoid, 2 * 8 * 2);  // two nights
  EXPECT_LE(undecided, 3);
}

TEST_F(Nights, FaultsAreNamedWithTheNightTheyBegan) {
  Build build;
  std::map<std::string, int> firstSeen;
  for (int i = 1; i <= 20; ++i) {
    if (i == 5) build.cost["a"] = 1.08;
    if (i >= 6 && i <= 9) build.cost["b"] = std::pow(1.03, i - 5);
    if (i == 7) build.steps["c"] = 1;
    if (i == 8) build.nan.insert("d");
    if (i == 9) build.crash.insert("e");
    if (i == 10) build.counters["f"] = {{"refused", 3}};
    if (i == 11) addScene("new");
    if (i == 12) std::erase_if(suite.scenes, [](const auto& one) { return one.name == "g"; });
    if (i == 13) scene("h").settings = {{"image.width", "64"}};
    if (i == 14) build.memory["h"] = 150;
    const std::vector<Verdict> verdicts = night(build);
    if (i == 1) acceptVerdicts(*history, {{"*"}, "first", "tester"});
    SCOPED_TRACE("night " + std::to_string(i) + "\n" + failures(verdicts));
    for (const Verdict& verdict : verdicts) {
      if (outcomeOf(verdict) != Outcome::Regression && outcomeOf(verdict) != Outcome::Crash)
        continue;
      // Nothing but what was put in is named, and with its night
      const std::map<std::string, std::pair<std::set<std::string>, int>> truth = {
          {"own.a.m", {{"time", "creep"}, 5}}, {"own.b.m", {{"time", "creep"}, 6}},
          {"own.c.m", {{"picture"}, 7}},       {"own.d.m", {{"picture"}, 8}},
          {"own.e.m", {{"run"}, 9}},           {"own.f.m", {{"counter"}, 10}},
          {"own.h.m", {{"memory"}, 14}}};
      const auto found = truth.find(verdict.name);
      ASSERT_NE(found, truth.end()) << verdict.name;
      EXPECT_TRUE(found->second.first.contains(verdict.kind)) << verdict.name << verdict.kind;
      EXPECT_EQ(verdict.began, found->second.second) << verdict.name << " " << verdict.message;
      firstSeen.emplace(verdict.name, i);
    }
    if (i >= 7) {
      EXPECT_EQ(statusOf(verdicts, "c", "picture"), "changed");
      EXPECT_THAT(of(verdicts, "c", "picture").front().message, HasSubstr("worst_reflector"));
    }
    if (i >= 8) {
      std::string statuses;
      for (const Verdict& verdict : of(verdicts, "d", "picture")) statuses += verdict.status + " ";
      EXPECT_THAT(statuses, HasSubstr("not finite"));
    }
    EXPECT_EQ(statusOf(verdicts, "new", "scene"), i == 11 ? "new" : "");
    if (i == 13) {
      EXPECT_EQ(statusOf(verdicts, "h", "scene"), "changed setting");
      EXPECT_THAT(of(verdicts, "h", "scene").front().message, HasSubstr("set:image.width 64"));
    }
    EXPECT_EQ(statusOf(verdicts, "g", "scene"), i == 1 ? "new" : i == 12 ? "removed" : "");
  }
  EXPECT_LE(firstSeen["own.a.m"], 6);  // one night may be void
  EXPECT_LE(firstSeen["own.b.m"], 9);
  for (const auto& [name, night] :
       std::map<std::string, int>{{"own.c.m", 7}, {"own.d.m", 8}, {"own.e.m", 9}, {"own.f.m", 10}})
    EXPECT_EQ(firstSeen[name], night) << name;
  for (const auto& [name, night] : firstSeen) std::printf("%s: night %d\n", name.c_str(), night);
}

TEST_F(Nights, ChangedSettingsAreNamedAndEachCaseIsCountedOnce) {
  std::erase_if(suite.scenes, [](const auto& one) { return one.name > "d"; });
  EXPECT_THAT(summaryOf(night({})).text(),
              HasSubstr("4 cases: 0 regressions, 0 crashes, 4 new; 32 "));
  acceptVerdicts(*history, {{"*"}, "first", "tester"});
  scene("a").settings = {{"image.width", "64"}};
  scene("b").settings = {{"image.width", "64"}};
  Build build;
  build.nan.insert("b");
  build.steps["c"] = 1;
  const std::vector<Verdict> verdicts = night(build);
  const Summary summary = summaryOf(verdicts);
  EXPECT_EQ(summary.regressions, 2);  // b and c, with 8 frames each
  EXPECT_EQ(summary.skipped, 1);
  EXPECT_THAT(summary.text(), HasSubstr("1 changed settings; "));
  EXPECT_THAT(summary.text(), HasSubstr("; changed settings: own.a.m, own.b.m"));
  PageOptions page;
  page.out = folder / "page";
  EXPECT_THAT(readTextFile(writePage(*history, *history->night(2), verdicts, page)),
              HasSubstr("; changed settings: own.a.m, own.b.m.</p>"));
  acceptVerdicts(*history, {{"c.m"}, "it has to", "tester"});
  EXPECT_THAT(summaryOf(history->verdicts(2)).text(), HasSubstr("1 accepted, 1 changed settings"));
}

TEST_F(Nights, FlickerThatRisesIsARegression) {
  std::erase_if(suite.scenes, [](const auto& one) { return one.name > "b"; });
  for (NightScene& one : suite.scenes) one.against = "truth";
  suite.gates.flicker = 0.2;
  night({});
  acceptVerdicts(*history, {{"*"}, "first", "tester"});
  EXPECT_EQ(statusOf(night({}), "a", "flicker"), "same");
  // A constant error hardly flickers; one that comes and goes does
  Build build;
  build.steps["a"] = 3;
  build.pops["b"] = 3;
  const std::vector<Verdict> verdicts = night(build);
  EXPECT_EQ(statusOf(verdicts, "a", "picture"), "changed");
  EXPECT_EQ(statusOf(verdicts, "a", "flicker"), "holds");
  EXPECT_EQ(statusOf(verdicts, "b", "flicker"), "rises");
  const Verdict rises = of(verdicts, "b", "flicker").front();
  EXPECT_EQ(outcomeOf(rises), Outcome::Regression);
  EXPECT_EQ(rises.began, 3);
  EXPECT_EQ(rises.lastGood, "b102");
  // 121 of 1024 pixels change by about 3 steps, from each frame to the next
  EXPECT_NEAR(rises.value, 3.0 * 121 / 1024, 0.1);
  EXPECT_THAT(rises.message, HasSubstr("the accepted frames 0.000; most in frame "));
  acceptVerdicts(*history, {{"own.b.m"}, "it has to", "tester"});
  EXPECT_EQ(statusOf(night(build), "b", "flicker"), "same");
  EXPECT_EQ(statusOf(night({}), "b", "flicker"), "falls");
}

TEST_F(Nights, AnyKeptBuildCanBeTheMeasure) {
  night({});
  Build build;
  build.cost["a"] = 1.2;
  night(build);
  EXPECT_THROW(keptBuild(*history, "c"), UsageError);
  EXPECT_THROW(keptBuild(*history, "b1"), UsageError);  // both begin so
  baseline = keptBuild(*history, "b102");
  const std::vector<Verdict> named = night(build);
  EXPECT_EQ(statusOf(named, "a", "time"), "holds");
  EXPECT_THAT(of(named, "a", "time").front().message, HasSubstr("the named build b102"));
  EXPECT_EQ(statusOf(named, "a", "creep"), "creeps");
  baseline = role::kAnchor;
  const std::vector<Verdict> anchor = night(build);
  EXPECT_EQ(statusOf(anchor, "a", "time"), "");
  EXPECT_EQ(statusOf(anchor, "a", "creep"), "creeps");
  // What was measured against others has not moved the accepted build
  baseline = role::kAccepted;
  EXPECT_EQ(history->baseline("own.a.m", history->result(1, "own.a.m").bench, "machine", "accepted")
                ->build,
            "b101");
  EXPECT_EQ(statusOf(night(build), "a", "time"), "slower");
}

TEST_F(Nights, OldSamplesBecomeMediansAndOldFramesGo) {
  std::erase_if(suite.scenes, [](const auto& one) { return one.name != "a"; });
  for (int i = 0; i < kRawNights + 2; ++i) night({});
  const auto rounds = [&](int number) {
    return history->result(number, "own.a.m").timings.front().times.size();
  };
  EXPECT_EQ(rounds(2), 1u);
  EXPECT_GE(rounds(3), 8u);
  EXPECT_GE(rounds(kRawNights + 2), 8u);
  const study::RoundTimes medians = history->result(2, "own.a.m").timings.front().times;
  EXPECT_EQ(medians.front().size(), kTestFrames.size());
  EXPECT_TRUE(fs::exists(history->nightFolder(2)));
  dropOld(*history);
  EXPECT_FALSE(fs::exists(history->nightFolder(2)));
  EXPECT_TRUE(fs::exists(history->nightFolder(3)));
  EXPECT_TRUE(fs::exists(keptProgram(*history, "b101")));  // the anchor
  EXPECT_FALSE(fs::exists(keptProgram(*history, "b102")));
}

TEST_F(Nights, WhatIsAcceptedHoldsAndCanBeTakenBack) {
  night({});
  EXPECT_THROW(acceptVerdicts(*history, {{"*"}, "", "tester"}), UsageError);
  EXPECT_THROW(acceptVerdicts(*history, {{"nothing.*"}, "why", "tester"}), UsageError);
  EXPECT_TRUE(history->acknowledgements().empty());
  acceptVerdicts(*history, {{"*"}, "first", "tester"});
  Build build;
  build.steps["c"] = 2;
  build.cost["a"] = 1.2;
  EXPECT_THAT(failures(night(build)), HasSubstr("own.c.m picture changed"));
  const Accepted accepted = acceptVerdicts(*history, {{"c.m:3", "a.m"}, "wanted", "tester"});
  EXPECT_EQ(accepted.frames, 1);
  EXPECT_EQ(accepted.times, 1);
  // Judged again, the night keeps what a person said of it
  const auto accepts = [&](const Verdict& verdict) {
    return verdict.acknowledgement == accepted.acknowledgement;
  };
  EXPECT_EQ(std::ranges::count_if(history->verdicts(2), accepts), 2);
  EXPECT_EQ(std::ranges::count_if(
                judgeNight(*history, *history->night(2), suite.gates, {"refused"}), accepts),
            2);
  // Accepted twice is refused: nothing of it is left
  EXPECT_THROW(acceptVerdicts(*history, {{"c.m:3"}, "wanted", "tester"}), UsageError);
  std::string after = failures(night(build));
  EXPECT_THAT(after, testing::Not(HasSubstr("own.a.m")));
  EXPECT_THAT(after, HasSubstr("own.c.m picture changed"));  // the other frames
  acceptVerdicts(*history, {{"c.m"}, "all of it", "tester"});
  EXPECT_EQ(failures(night(build)), "");
  history->undo(accepted.acknowledgement, utcNow());
  EXPECT_THROW(history->undo(accepted.acknowledgement, utcNow()), UsageError);
  after = failures(night(build));
  EXPECT_THAT(after, HasSubstr("own.a.m"));
}

TEST_F(Nights, AChangedSceneWaitsUntilItIsAccepted) {
  night({});
  lab.edits["b"] = "2";
  EXPECT_EQ(failures(night({})), "");  // nothing was accepted before
  acceptVerdicts(*history, {{"*"}, "first", "tester"});
  EXPECT_EQ(failures(night({})), "");
  lab.edits["a"] = "2";
  for (int i = 0; i < 2; ++i) {
    const std::vector<Verdict> verdicts = night({});
    EXPECT_THAT(failures(verdicts), HasSubstr("own.a.m scene changed scene"));
    EXPECT_THAT(of(verdicts, "a", "scene").front().message, HasSubstr("scene a -> a2"));
    EXPECT_EQ(of(verdicts, "a", "scene").front().began, 4);
    EXPECT_EQ(of(verdicts, "a", "scene").front().firstBad, "");
    EXPECT_EQ(statusOf(verdicts, "a", "picture"), "new");
    EXPECT_EQ(summaryOf(verdicts).regressions, 1);
  }
  PageOptions page;
  page.out = folder / "page";
  const Night last = *history->night(5);
  const std::string html = readTextFile(writePage(*history, last, history->verdicts(5), page));
  EXPECT_LT(html.find("<h2>Changed scenes</h2>"), html.find("<article id=\"own.a.m\""));
  EXPECT_LT(html.find("<article id=\"own.a.m\""), html.find("<h2>Problems</h2>"));
  EXPECT_THAT(html, HasSubstr("pictures/own.a.m.1.accepted.png"));
  EXPECT_THAT(html, HasSubstr("pictures/own.a.m.1.tonight.png"));
  EXPECT_THAT(html, HasSubstr("catoptric nightly accept own.a.m"));
  acceptVerdicts(*history, {{"a.m"}, "a better ball", "tester"});
  EXPECT_EQ(summaryOf(history->verdicts(5)).regressions, 0);
  EXPECT_EQ(failures(night({})), "");
  lab.edits["a"] = "3";  // what was accepted is the measure now
  const std::vector<Verdict> again = night({});
  EXPECT_THAT(failures(again), HasSubstr("own.a.m scene changed scene"));
  EXPECT_THAT(of(again, "a", "scene").front().message, HasSubstr("scene a2 -> a3"));
  EXPECT_EQ(of(again, "a", "scene").front().began, 7);
  EXPECT_EQ(summaryOf(again).regressions, 1);
  lab.edits["a"] = "";  // what was accepted before is known, too
  EXPECT_EQ(failures(night({})), "");
}

TEST_F(Nights, WhatHasChangedInAnInterruptedNightIsMeasuredAgain) {
  const NightOptions options = [&] {
    NightOptions one;
    one.program = folder / "programs" / "b1";
    std::ofstream(one.program) << "b1";
    return one;
  }();
  builds["b1"] = {};
  const Night wanted{0,  "own", "p", "full", "machine", "b1", "1.0", "2026-01-01T00:00:00Z",
                     "", false};
  const OpenNight open(*history, wanted);
  const auto measure = [&] {
    measureNight(*history, open.night(), casesOf(suite, "full", {}, lab), suite.gates, lab,
                 options);
  };
  measure();
  const std::string before = history->bench(open.night().id, "own.a.m")->first;
  lab.edits["a"] = "2";
  measure();
  EXPECT_NE(history->bench(open.night().id, "own.a.m")->first, before);
  EXPECT_EQ(history->measured(open.night().id).size(), suite.scenes.size());
  EXPECT_EQ(history->result(open.night().id, "own.a.m").frames.size(), kTestFrames.size());
}

/// SQLite has written pages of the unfinished change by then.
TEST_F(Nights, AReaderRollsBackWhatAKilledProcessLeft) {
  night(Build{});
  const fs::path file = folder / "history.db";
  history.reset();
  const pid_t child = ::fork();
  if (child == 0) {
    SQLite::Database database(file.string(), SQLite::OPEN_READWRITE);
    database.exec(
        "PRAGMA cache_size = 1; BEGIN; CREATE TABLE half AS WITH RECURSIVE n(i) AS (SELECT 1 "
        "UNION ALL SELECT i + 1 FROM n WHERE i < 99) SELECT randomblob(4096) FROM n");
    ::_exit(0);
  }
  ASSERT_EQ(::waitpid(child, nullptr, 0), child);
  ASSERT_TRUE(fs::exists(folder / "history.db-journal"));
  EXPECT_EQ(History(file, History::Mode::Read).nights("", 1).size(), 1u);
}

TEST_F(Nights, DamagedAndEmptyHistoriesAreSaid) {
  night(Build{});
  const fs::path file = folder / "damaged.db";
  fs::copy_file(folder / "history.db", file);
  SQLite::Database(file.string(), SQLite::OPEN_READWRITE)
      .exec("PRAGMA foreign_keys = OFF; UPDATE night SET id = 1686936784000");
  const auto error = [](const fs::path& damaged, History::Mode mode) -> std::string {
    try {
      History(damaged, mode).nights("", 1);
    } catch (const UsageError& thrown) {
      return thrown.what();
    }
    return "";
  };
  EXPECT_THAT(error(file, History::Mode::Write), HasSubstr("damaged"));
  const std::ofstream empty(folder / "empty.db");
  EXPECT_THAT(error(folder / "empty.db", History::Mode::Read), HasSubstr("the history is empty"));
}

TEST_F(Nights, WhatHasNotBeenRenderedCannotBeAccepted) {
  Build build;
  build.nan.insert("d");
  build.crash.insert("e");
  night(build);
  acceptVerdicts(*history, {{"*"}, "first", "tester"});
  for (const char* name : {"d", "e"}) {
    const std::string full = std::string("own.") + name + ".m";
    EXPECT_TRUE(history->references(full, history->result(1, full).bench).empty());
    EXPECT_THROW(acceptVerdicts(*history, {{full}, "why", "tester"}), UsageError);
  }
}

}  // namespace
}  // namespace catoptric::nightly
