#include "nightly/judge_night.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "core/error.h"
#include "core/text.h"
#include "measure/motion.h"
#include "nightly/bench_print.h"
#include "nightly/pictures.h"
#include "report/table.h"
#include "run/folder/records.h"

namespace catoptric::nightly {
namespace {

/// Of the calls "slower" that may be wrong. [Benjamini1995]
constexpr double kFalseCalls = 0.05;
/// A change of level has to explain as much of the logarithms of ratios. Ours: a little less than
/// the 3 % of a creep's steps, and more than the noise of nights (0.7 % in nights_test.cpp).
constexpr double kChangePenalty = 0.025;
/// A level nearer to the anchor build is not part of a creep, nor a night nearer to the level
/// before it. Ours: half of a step of 3 %.
constexpr double kAnchorLevel = 1.015;

std::string nightText(int night) {
  return "night " + std::to_string(night);
}

std::string shortBuild(const std::string& build) {
  return build.substr(0, 8);
}

class NightJudge {
 public:
  NightJudge(History& history, const Night& night, const Gates& gates,
             const std::vector<std::string>& mustBeZero)
      : history_(history), night_(night), gates_(gates), mustBeZero_(mustBeZero) {}

  std::vector<Verdict> judge() {
    for (const std::string& name : history_.measured(night_.id))
      facts_.push_back(history_.result(night_.id, name));
    findPrevious();
    for (const CaseFacts& facts : facts_) {
      judgeScene(facts);
      if (facts.failure.find("such a frame is not written") !=
          std::string::npos) {  // says the encoder
        add(facts.name, "picture", "not finite", Outcome::Regression, 0, facts.failure);
        continue;
      }
      if (!facts.failure.empty()) {
        add(facts.name, "run", "crash", Outcome::Crash, 0, facts.failure);
        continue;
      }
      add(facts.name, "run", "renders", Outcome::Good, 0,
          std::to_string(facts.frames.size()) + " frames");
      judgePictures(facts);
      judgeFlicker(facts);
      judgeMemory(facts);
    }
    judgeRemoved();
    judgeTimes();
    for (Verdict& verdict : verdicts_) findBeginning(verdict);
    return std::move(verdicts_);
  }

  const std::vector<std::pair<std::string, Baseline>>& baselines() const { return baselines_; }

 private:
  Verdict& add(const std::string& name, const std::string& kind, const std::string& status,
               Outcome outcome, int frame, const std::string& message) {
    Verdict verdict{name, kind, status, outcome, frame};
    verdict.message = message;
    return verdicts_.emplace_back(std::move(verdict));
  }

  void findPrevious() {
    for (const Night& night : history_.nights(night_.suite, 400))
      if (night.id < night_.id && !night.finished.empty() && night.effort == night_.effort &&
          !night.partial) {
        previous_ = night;
        return;
      }
  }

  /// Whether other scenes were accepted, and this one was not: then it is not known who changed it,
  /// and whether its pictures are right.
  bool judgeChangedScene(const CaseFacts& facts) {
    const auto accepted = history_.acceptedBench(facts.name);
    if (!accepted || !history_.references(facts.name, facts.bench).empty()) return false;
    const std::string before = sceneLinesOf(accepted->second);
    const std::string now = sceneLinesOf(facts.description);
    if (before == now) return false;
    add(facts.name, "scene", kChangedScene, Outcome::Regression, 0,
        "its files have changed since its frames were accepted (" + differenceOf(before, now) +
            "). Look at the pictures before and now; accept them, or undo the change");
    return true;
  }

  /// Is the case new, or does it measure something else than before?
  void judgeScene(const CaseFacts& facts) {
    if (facts.bench == "none") return;  // its config is wrong
    if (judgeChangedScene(facts)) return;
    std::optional<std::pair<std::string, std::string>> before;
    for (const Night& night : history_.nights(night_.suite, 400)) {
      if (night.id >= night_.id || night.effort != night_.effort) continue;
      before = history_.bench(night.id, facts.name);
      if (before && before->first != "none") break;
    }
    if (!before) {
      add(facts.name, "scene", "new", Outcome::Skipped, 0,
          "the case is new: its times begin with this night, and its frames wait for acceptance");
      return;
    }
    if (before->first == facts.bench) return;
    add(facts.name, "scene", kChangedSetting, Outcome::Skipped, 0,
        "its settings have changed, so its history starts again: " +
            differenceOf(before->second, facts.description));
  }

  void judgeRemoved() {
    if (!previous_ || night_.partial) return;
    const std::set<std::string> now = history_.measured(night_.id);
    for (const std::string& name : history_.measured(previous_->id))
      if (!now.contains(name))
        add(name, "scene", "removed", Outcome::Skipped, 0,
            "it was measured in " + nightText(previous_->id) + " and is not in the suite any more");
  }

  void judgePictures(const CaseFacts& facts) {
    const std::map<int, Reference> references = history_.references(facts.name, facts.bench);
    int same = 0;
    int counted = 0;
    std::uint64_t bytes = 0;
    std::uint64_t acceptedBytes = 0;
    for (const auto& [number, frame] : facts.frames) {
      const auto accepted = references.find(number);
      const bool known = accepted != references.end();
      same += judgeFrame(facts, number, frame, known ? &accepted->second : nullptr) ? 1 : 0;
      const std::vector<std::string> worse =
          worseCounters(frame.counters,
                        known ? accepted->second.counters : std::map<std::string, std::uint64_t>{},
                        mustBeZero_, gates_);
      if (!worse.empty())
        add(facts.name, "counter", "rises", Outcome::Regression, number, joined(worse, "; "));
      counted += worse.empty() ? 1 : 0;
      bytes += known ? frame.bytes : 0;
      acceptedBytes += known ? accepted->second.bytes : 0;
    }
    if (same > 0)
      add(facts.name, "picture", "same", Outcome::Good, 0,
          std::to_string(same) + " frames have the accepted pixels");
    if (counted > 0)
      add(facts.name, "counter", "holds", Outcome::Good, 0, std::to_string(counted) + " frames");
    if (acceptedBytes == 0) return;
    const double ratio = static_cast<double>(bytes) / static_cast<double>(acceptedBytes);
    const bool fails = ratio > 1.0 + gates_.disk;
    add(facts.name, "disk", fails ? "fails" : "holds", fails ? Outcome::Regression : Outcome::Good,
        0,
        "the files of the frames are " + report::fixedText(ratio, 3) +
            " times as large as the accepted ones")
        .value = ratio;
  }

  /// True when the frame has the accepted pixels.
  bool judgeFrame(const CaseFacts& facts, int number, const FrameFacts& frame,
                  const Reference* accepted) {
    if (accepted != nullptr && accepted->pixels == frame.pixels) return true;
    if (frame.notFinite > 0) {
      add(facts.name, "picture", "not finite", Outcome::Regression, number,
          std::to_string(frame.notFinite) + " pixels are NaN or infinite");
      return false;
    }
    if (accepted == nullptr) {
      add(facts.name, "picture", "new", Outcome::Skipped, number, "no frame was accepted yet");
      return false;
    }
    try {
      const image::Image now = image::readImage(history_.folder() / frame.file);
      const image::Image before = image::readImage(storedFrame(history_, accepted->object));
      const PictureComparison comparison = comparePictures(now, before);
      const PictureState state =
          judgePicture(comparison.errors, gates_, truthErrors(facts, number, now, before));
      const Outcome outcome = state.status == "changed"    ? Outcome::Regression
                              : state.status == "improved" ? Outcome::Skipped
                                                           : Outcome::Good;
      add(facts.name, "picture", state.status, outcome, number,
          state.status == "within" ? "differs by less than its limits" : state.message)
          .value = state.value;
    } catch (const Error& error) {
      add(facts.name, "picture", "changed", Outcome::Regression, number,
          std::string("cannot be compared: ") + error.what());
    }
    return false;
  }

  /// L1_8bit of tonight's and the accepted frame against the truth.
  std::optional<std::pair<double, double>> truthErrors(const CaseFacts& facts, int number,
                                                       const image::Image& now,
                                                       const image::Image& before) const {
    if (facts.truth.empty()) return {};
    const std::filesystem::path file = truthOf(facts, number);
    std::error_code ignored;
    if (!std::filesystem::exists(file, ignored)) return {};
    const image::Image truth = image::readImage(file);
    return std::pair(comparePictures(now, truth).errors.at("L1_8bit"),
                     comparePictures(before, truth).errors.at("L1_8bit"));
  }

  std::filesystem::path truthOf(const CaseFacts& facts, int number) const {
    return history_.folder() / facts.truth / run::framePath("frames", number, ".exr");
  }

  /// Whether tonight's frames flicker more against the truth than the accepted ones do, over those
  /// pairs of consecutive frames of which one has changed.
  void judgeFlicker(const CaseFacts& facts) {
    const bool changed = std::ranges::any_of(
        facts.frames, [](const auto& frame) { return !frame.second.file.empty(); });
    if (!changed && facts.frames.size() > 1) {
      add(facts.name, "flicker", "same", Outcome::Good, 0, "its frames are the accepted ones");
      return;
    }
    if (facts.truth.empty()) return;
    const std::map<int, Reference> references = history_.references(facts.name, facts.bench);
    measure::MotionMeter tonight;
    measure::MotionMeter accepted;
    try {
      for (const auto& [number, frame] : facts.frames) {
        const auto known = references.find(number);
        std::error_code ignored;
        if (!facts.differsNear(number) || known == references.end() ||
            known->second.object.empty() ||
            !std::filesystem::exists(truthOf(facts, number), ignored))
          continue;
        const image::Image truth = image::readImage(truthOf(facts, number));
        const image::Image before = image::readImage(storedFrame(history_, known->second.object));
        const image::Image now =
            frame.file.empty() ? before : image::readImage(history_.folder() / frame.file);
        tonight.add(number, measure::signedError(now, truth));
        accepted.add(number, measure::signedError(before, truth));
      }
    } catch (const Error&) {
      return;  // the verdict on the pictures says so
    }
    const measure::MotionError& motion = tonight.result();
    if (motion.pairs == 0) return;
    const double now = motion.all.mean();
    const double before = accepted.result().all.mean();
    const bool rises = now > before + gates_.flicker;
    add(facts.name, "flicker",
        rises                           ? "rises"
        : now < before - gates_.flicker ? "falls"
                                        : "holds",
        rises ? Outcome::Regression : Outcome::Good, 0,
        report::fixedText(now, 3) + " display steps against the reference, the accepted frames " +
            report::fixedText(before, 3) + "; most in frame " + std::to_string(motion.worstFrame) +
            ", around pixel " + std::to_string(motion.worstX) + "," + std::to_string(motion.worstY))
        .value = now;
  }

  void judgeMemory(const CaseFacts& facts) {
    const auto now = facts.memory.find(role::kTonight);
    const auto before = facts.memory.find(role::kAccepted);
    if (now == facts.memory.end() || before == facts.memory.end() || before->second == 0) return;
    const double ratio = static_cast<double>(now->second) / static_cast<double>(before->second);
    const bool fails = ratio > 1.0 + gates_.memory;
    add(facts.name, "memory", fails ? "fails" : "holds",
        fails ? Outcome::Regression : Outcome::Good, 0,
        "largest memory " + std::to_string(now->second >> 20) + " MiB, " +
            report::fixedText(ratio, 3) + " times that of the accepted build")
        .value = ratio;
  }

  /// How far tonight's build is from itself; beyond the gate no time can be believed.
  bool timesAreVoid() {
    bool isVoid = false;
    for (const CaseFacts& facts : facts_) {
      const std::optional<TimeRatio> again = timeRatio(facts, role::kAgain, 1, gates_.time);
      if (!again) continue;
      const double value = again->ratio.value;
      const bool beyond = std::max(value, 1.0 / value) > 1.0 + gates_.again;
      isVoid = isVoid || beyond;
      Verdict& verdict = add(facts.name, "noise", beyond ? "beyond" : "holds",
                             beyond ? Outcome::Skipped : Outcome::Good, 0,
                             "tonight's build, timed twice, took " +
                                 study::ratioText(again->ratio) + " times as long the second time");
      setRatio(verdict, again->ratio);
    }
    return isVoid;
  }

  static void setRatio(Verdict& verdict, const study::Ratio& ratio) {
    verdict.value = ratio.value;
    verdict.low = ratio.interval ? ratio.interval->low : ratio.value;
    verdict.high = ratio.interval ? ratio.interval->high : ratio.value;
  }

  struct Timed {
    const CaseFacts* facts = nullptr;
    const char* role = nullptr;
    TimeRatio ratio;
  };

  void judgeTimes() {
    const bool isVoid = timesAreVoid();
    std::vector<Timed> timed;
    for (const CaseFacts& facts : facts_) {
      if (!facts.failure.empty()) continue;
      for (const char* name : kBaselines) {
        const std::optional<TimeRatio> ratio = confirmedRatio(facts, name, gates_.time);
        if (ratio) timed.push_back({&facts, name, *ratio});
      }
    }
    std::vector<double> p;
    for (const Timed& one : timed) p.push_back(one.ratio.p);
    const std::vector<bool> called = falseDiscoveries(p, kFalseCalls);
    for (std::size_t i = 0; i < timed.size(); ++i) {
      if (timed[i].ratio.state == TimeState::Fails && !called[i])
        timed[i].ratio.state = TimeState::Undecided;
      addTime(timed[i], isVoid);
    }
    for (const CaseFacts& facts : facts_) addBaselines(facts, timed, isVoid);
  }

  static std::string buildOf(const CaseFacts& facts, const std::string& role) {
    for (const Timing& timing : facts.timings)
      if (timing.role == role) return timing.build;
    return "";
  }

  void addTime(const Timed& one, bool isVoid) {
    const bool creep = std::string(one.role) == role::kAnchor;
    const std::optional<Baseline> baseline =
        history_.baseline(one.facts->name, one.facts->bench, night_.machine, one.role);
    const study::Ratio& ratio = one.ratio.ratio;
    std::string status = "undecided";
    Outcome outcome = Outcome::Skipped;
    if (isVoid) {
      status = "void";
    } else if (one.ratio.state == TimeState::Fails) {
      status = creep ? "creeps" : "slower";
      outcome = Outcome::Regression;
    } else if (one.ratio.state == TimeState::Holds) {
      const bool faster = ratio.interval && ratio.interval->high < 1.0 / (1.0 + gates_.time);
      status = faster ? "faster" : "holds";
      outcome = Outcome::Good;
    }
    Verdict& verdict = add(one.facts->name, creep ? "creep" : "time", status, outcome, 0,
                           "takes " + study::ratioText(ratio) + " times as long as the " +
                               (creep      ? "anchor"
                                : baseline ? "accepted"
                                           : "named") +
                               " build " + shortBuild(buildOf(*one.facts, one.role)) +
                               (baseline ? " of " + nightText(baseline->night) : ""));
    setRatio(verdict, ratio);
  }

  /// What the case is compared with from now on.
  void addBaselines(const CaseFacts& facts, const std::vector<Timed>& timed, bool isVoid) {
    if (!facts.failure.empty() || facts.bench == "none") return;
    const auto baseline = [&](const char* name) {
      return history_.baseline(facts.name, facts.bench, night_.machine, name);
    };
    const auto set = [&](const char* name) {
      baselines_.emplace_back(facts.name, Baseline{name, night_.build, night_.id});
    };
    if (!baseline(role::kAnchor)) {
      set(role::kAnchor);
      set(role::kAccepted);
      return;
    }
    for (const char* name : kBaselines) {
      const auto failed = facts.baselineFailures.find(name);
      if (failed == facts.baselineFailures.end()) continue;
      add(facts.name, std::string(name) == role::kAnchor ? "creep" : "time", "no baseline",
          Outcome::Skipped, 0,
          "the " + std::string(name) + " build cannot render it: " + failed->second);
      if (std::string(name) != role::kNamed) set(name);  // the next night has one again
    }
    // A build that is faster because its pictures are wrong must not be the measure of the next one
    if (std::ranges::any_of(verdicts_, [&](const Verdict& verdict) {
          return verdict.name == facts.name && verdict.kind != "creep" &&
                 verdict.outcome == Outcome::Regression;
        }))
      return;
    for (const Timed& one : timed)
      if (one.facts == &facts && std::string(one.role) == role::kAccepted && !isVoid &&
          one.ratio.state == TimeState::Holds)
        set(role::kAccepted);
  }

  /// Since which night the case has had tonight's scene. No build is at fault.
  void findChange(Verdict& verdict) {
    const std::string bench = history_.result(night_.id, verdict.name).bench;
    for (const History::Past& past :
         history_.past(verdict.name, verdict.kind, night_.machine, night_.id))
      if (past.bench == bench && past.verdict.status == kChangedScene) verdict.began = past.night;
  }

  /// With which night a fault began: before it the last one that was good.
  void findBeginning(Verdict& verdict) {
    if (verdict.kind == "scene") verdict.began = night_.id;
    if (verdict.outcome != Outcome::Regression && verdict.outcome != Outcome::Crash) return;
    verdict.began = night_.id;
    if (verdict.status == kChangedScene) return findChange(verdict);
    verdict.firstBad = night_.build;
    if (verdict.kind == "creep") return findCreep(verdict);
    struct Seen {
      bool bad = false;
      bool good = false;
      std::string build;
    };
    std::map<int, Seen, std::greater<>> nights;
    for (const History::Past& past :
         history_.past(verdict.name, verdict.kind, night_.machine, night_.id)) {
      const Outcome outcome = past.verdict.outcome;
      Seen& seen = nights[past.night];
      seen.build = past.build;
      if (past.verdict.frame == verdict.frame)
        seen.bad = seen.bad || outcome == Outcome::Regression || outcome == Outcome::Crash;
      if (past.verdict.frame == verdict.frame || past.verdict.frame == 0)
        seen.good = seen.good || outcome == Outcome::Good;
    }
    int undecided = 0;  // the first night since the last good one that said neither
    for (const auto& [number, seen] : nights) {
      if (seen.bad) {
        verdict.began = number;
        verdict.firstBad = seen.build;
        undecided = 0;
      } else if (seen.good) {
        verdict.lastGood = seen.build;
        break;
      } else {
        undecided = number;
      }
    }
    if (undecided == 0 || verdict.lastGood.empty()) return;
    if (verdict.kind == "time")
      beginAtLevel(verdict, undecided);
    else
      verdict.message += "; perhaps since " + nightText(undecided) + ", which was undecided";
  }

  /// Of the nights from `first` on that were not decided, those that took as long as the first bad
  /// one are bad, too.
  void beginAtLevel(Verdict& verdict, int first) {
    const std::vector<TrendPoint> trend = trendUpTo(verdict);
    for (const Level& level : levelsOf(trend)) {
      const auto begin = trend.begin() + static_cast<std::ptrdiff_t>(level.first);
      const auto end = begin + static_cast<std::ptrdiff_t>(level.count);
      const auto same = [&](const TrendPoint& point) { return point.night == verdict.began; };
      if (std::none_of(begin, end, same)) continue;
      const auto since =
          std::find_if(begin, end, [&](const TrendPoint& point) { return point.night >= first; });
      if (since->night == verdict.began) break;
      verdict.message += "; " + nightText(verdict.began) + " was the first that was not undecided";
      verdict.began = since->night;
      if (const auto bad = history_.night(verdict.began)) verdict.firstBad = bad->build;
      return;
    }
    if (first < verdict.began)
      verdict.message += "; perhaps since " + nightText(first) + ", which was undecided";
  }

  /// Ratios to the anchor build up to tonight's.
  std::vector<TrendPoint> trendUpTo(const Verdict& verdict) {
    const std::string bench = history_.result(night_.id, verdict.name).bench;
    std::vector<TrendPoint> trend = trendOf(history_, night_, verdict.name, bench);
    const auto creep = std::ranges::find_if(verdicts_, [&](const Verdict& other) {
      return other.name == verdict.name && other.kind == "creep" && other.value > 0.0;
    });
    const Verdict& now = creep == verdicts_.end() ? verdict : *creep;
    trend.push_back({night_.id, now.value, now.low, now.high});
    return trend;
  }

  void findCreep(Verdict& verdict) {
    const std::vector<TrendPoint> trend = trendUpTo(verdict);
    const std::vector<Level> levels = levelsOf(trend);
    if (levels.size() == 1) {
      verdict.began = trend.front().night;
      verdict.message += "; slower since " + nightText(verdict.began);
      return;
    }
    // Back over the levels that rise
    std::size_t first = levels.size() - 1;
    while (first > 1 && levels[first - 1].value < levels[first].value &&
           levels[first - 1].value > kAnchorLevel)
      --first;
    std::size_t began = levels[first].first;
    // Which nights' intervals leave the level before it: noise may look like a step, and a step be
    // too small for a level of its own
    const double before = levels[first - 1].value;
    while (began + 1 < trend.size() && trend[began].low <= before) ++began;
    while (began > 1 && trend[began - 1].low > before &&
           trend[began - 1].value > kAnchorLevel * before)
      --began;
    verdict.began = trend[began].night;
    if (const auto good = history_.night(trend[began - 1].night)) verdict.lastGood = good->build;
    if (const auto bad = history_.night(verdict.began)) verdict.firstBad = bad->build;
    verdict.message += "; it began with " + nightText(verdict.began) + ", in " +
                       std::to_string(levels.size() - first) +
                       (levels.size() - first == 1 ? " step" : " steps");
  }

  History& history_;
  const Night& night_;
  const Gates& gates_;
  const std::vector<std::string>& mustBeZero_;
  std::vector<CaseFacts> facts_;
  std::optional<Night> previous_;
  std::vector<Verdict> verdicts_;
  std::vector<std::pair<std::string, Baseline>> baselines_;
};

}  // namespace

std::vector<TrendPoint> trendOf(const History& history, const Night& night, const std::string& name,
                                const std::string& bench) {
  std::vector<TrendPoint> trend;
  std::map<int, TrendPoint> points;
  // While the accepted build is the anchor, its ratio is the anchor's
  for (const char* kind : {"time", "creep"})
    for (const History::Past& past : history.past(name, kind, night.machine, night.id))
      if (past.bench == bench && past.verdict.value > 0.0 && past.verdict.status != "void" &&
          (std::string(kind) == "creep" || !points.contains(past.night)))
        points[past.night] = {past.night, past.verdict.value, past.verdict.low, past.verdict.high};
  for (const auto& [number, point] : points) trend.push_back(point);
  return trend;
}

std::vector<Level> levelsOf(const std::vector<TrendPoint>& trend) {
  std::vector<double> logs;
  for (const TrendPoint& point : trend) logs.push_back(std::log(point.value));
  std::vector<std::size_t> starts = changePoints(logs, kChangePenalty);
  starts.insert(starts.begin(), 0);
  std::vector<Level> levels;
  for (std::size_t i = 0; i < starts.size(); ++i) {
    const std::size_t end = i + 1 < starts.size() ? starts[i + 1] : logs.size();
    levels.push_back({starts[i], end - starts[i],
                      std::exp(study::median({logs.begin() + static_cast<std::ptrdiff_t>(starts[i]),
                                              logs.begin() + static_cast<std::ptrdiff_t>(end)}))});
  }
  return levels;
}

std::vector<Verdict> judgeNight(History& history, const Night& night, const Gates& gates,
                                const std::vector<std::string>& mustBeZero) {
  history.forget(night.id);
  NightJudge judge(history, night, gates, mustBeZero);
  const std::vector<Verdict> verdicts = judge.judge();
  history.judge(night.id, verdicts, judge.baselines(), utcNow());
  history.thinSamples();
  return history.verdicts(night.id);
}

}  // namespace catoptric::nightly
