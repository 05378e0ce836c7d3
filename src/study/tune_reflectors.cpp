#include "study/tune_reflectors.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "config/json_text.h"
#include "core/error.h"
#include "report/contact_sheet.h"
#include "study/method_choice.h"

namespace catoptric::study {
namespace {

constexpr const char* kMetric = "L1_8bit";
constexpr std::size_t kTimedFrames = 8;  ///< spread over the path; ours
/// Reflectors with fewer of the frames' pixels stay with the fastest method; ours.
constexpr double kLeastShare = 0.001;
constexpr int kCorrections = 5;  ///< of a mixture that is less accurate than its parts said

/// One name of reflectors: objects that share it share a method.
struct Reflector {
  std::string name;
  std::set<int> ids;
  std::uint64_t pixels = 0;
};

/// One call of tuneReflectors().
class ReflectorTuning {
 public:
  ReflectorTuning(Bench& bench, const std::vector<std::string>& methods, const Bound& bound,
                  const TimeKind& time)
      : bench_(bench), bound_(bound), time_(time) {
    for (const std::string& method : methods)
      singles_.push_back(bench.prepare({method, {}, "", ""}));
    frames_ = bench.frames(singles_.front());
    timed_ = report::spread(frames_, kTimedFrames);
  }

  MixtureResult run() {
    measureSingles();
    findReflectors();
    measureMarginal();
    MixtureResult result;
    result.tables.push_back(singleTable());
    MixtureProblem problem = makeProblem();
    std::optional<std::vector<int>> choice;
    std::optional<Setting> mixture;
    for (int i = 0; i < kCorrections; ++i) {
      choice = cheapestMixture(problem);
      if (!choice) break;
      const Setting candidate = settingOf(*choice);
      bench_.findErrors({candidate}, frames_);
      if (bench_.failures().contains(candidate.key)) break;
      const double error = pooled(candidate);
      if (error <= bound_.limit) {
        mixture = candidate;
        break;
      }
      problem.mostError -= 1.01 * (error - bound_.limit);
    }
    decide(mixture, choice, result);
    return result;
  }

 private:
  double pooled(const Setting& setting) { return bench_.errors(setting).pooled(kMetric, frames_); }

  void measureSingles() {
    bench_.findErrors(singles_, frames_);
    const Samples& samples = bench_.measure(singles_, timed_, false);
    std::erase_if(singles_, [&](const Setting& setting) {
      return !samples.find(setting.key) || bench_.failures().contains(setting.key);
    });
    if (singles_.empty())
      throw Error(ExitCode::FramesFailed, "no method can render this scene; the errors are above");
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t m = 0; m < singles_.size(); ++m) {
      seconds_.push_back(
          frameSeconds(samples.measurement.times(*samples.find(singles_[m].key), time_)).mean);
      if (seconds_.back() >= least) continue;
      least = seconds_.back();
      base_ = m;
    }
  }

  /// Sum of a reflector's error by a method, as its part of the frames' L1_8bit.
  double errorOf(const Setting& setting, const Reflector& reflector) {
    std::uint64_t sum = 0;
    for (const auto& [number, frame] : bench_.errors(setting).frames)
      for (const int id : reflector.ids)
        if (const auto part = frame.objects.find(id); part != frame.objects.end())
          sum += part->second.sum8;
    return static_cast<double>(sum) / (3.0 * allPixels());
  }

  double allPixels() const {
    const methods::RunSettings& image = singles_.front().run.image;
    return static_cast<double>(image.width) * image.height * static_cast<double>(frames_.size());
  }

  void findReflectors() {
    std::map<std::string, Reflector> byName;
    for (const auto& [id, name] : bench_.reflectors(singles_.front())) {
      byName[name].name = name;
      byName[name].ids.insert(id);
    }
    for (auto& [name, reflector] : byName) {
      for (const auto& [number, frame] : bench_.errors(singles_[base_]).frames)
        for (const int id : reflector.ids)
          if (const auto part = frame.objects.find(id); part != frame.objects.end())
            reflector.pixels += part->second.pixels;
      if (static_cast<double>(reflector.pixels) >= kLeastShare * allPixels())
        reflectors_.push_back(reflector);
    }
    if (reflectors_.empty())
      throw UsageError("--per-reflector: no reflector covers 0.1 % of these frames' pixels");
  }

  /// The fastest method with some reflectors given to others.
  Setting settingOf(const std::vector<int>& choice) {
    config::JsonText rules;
    bool mixed = false;
    for (std::size_t r = 0; r < reflectors_.size(); ++r) {
      const auto m = static_cast<std::size_t>(choice[r]);
      if (m == base_) continue;
      mixed = true;
      const run::MethodConfig& method = singles_[m].run.methods.front();
      config::JsonText entry;
      entry.add("method", method.id);
      for (const std::string& name : method.options.keys())
        entry.raw(name, method.options.get(name).dump());
      rules.raw(reflectors_[r].name, entry.object());
    }
    if (!mixed) return singles_[base_];
    const std::string base = singles_[base_].point.method;
    return bench_.prepare({base, {{"methods." + base + ".reflectors", rules.object()}}, "", ""});
  }

  /// What each reflector costs by each method beyond what it costs by the fastest one.
  void measureMarginal() {
    marginal_.assign(reflectors_.size(), std::vector<double>(singles_.size(), 0.0));
    struct Trial {
      std::size_t reflector;
      std::size_t method;
      Setting setting;
    };
    std::vector<Trial> trials;
    for (std::size_t r = 0; r < reflectors_.size(); ++r)
      for (std::size_t m = 0; m < singles_.size(); ++m) {
        if (m == base_) continue;
        std::vector<int> choice(reflectors_.size(), static_cast<int>(base_));
        choice[r] = static_cast<int>(m);
        trials.push_back({r, m, settingOf(choice)});
      }
    for (std::size_t next = 0; next < trials.size();) {
      std::vector<Setting> batch{singles_[base_]};
      const std::size_t first = next;
      while (next < trials.size() && batch.size() < bench_.capacity())
        batch.push_back(trials[next++].setting);
      const Samples& samples = bench_.measure(batch, timed_, false);
      const auto base = samples.find(singles_[base_].key);
      for (std::size_t i = first; i < next; ++i) {
        const auto own = samples.find(trials[i].setting.key);
        double& cost = marginal_[trials[i].reflector][trials[i].method];
        cost = std::numeric_limits<double>::infinity();
        if (!own || !base) continue;  // this method cannot do that reflector
        const Ratio ratio = pairedRatio(samples.measurement.times(*own, time_),
                                        samples.measurement.times(*base, time_));
        cost = seconds_[base_] * (ratio.value - 1.0);
      }
    }
  }

  MixtureProblem makeProblem() {
    MixtureProblem problem;
    problem.mostError = bound_.limit - pooled(singles_[base_]);
    for (const Reflector& reflector : reflectors_) {
      std::vector<double> errors;
      for (const Setting& single : singles_) errors.push_back(errorOf(single, reflector));
      problem.mostError += errors[base_];
      problem.error.push_back(std::move(errors));
    }
    problem.cost = marginal_;
    // What a method costs as soon as it fills one reflector is in every reflector's cost: with all
    // of them it is there once.
    for (std::size_t m = 0; m < singles_.size(); ++m) {
      double sum = 0.0;
      std::size_t count = 0;
      for (std::size_t r = 0; r < reflectors_.size(); ++r)
        if (std::isfinite(marginal_[r][m])) {
          sum += marginal_[r][m];
          ++count;
        }
      const double all = seconds_[m] - seconds_[base_];
      const double fixed = m == base_ || count < 2
                               ? 0.0
                               : std::max(0.0, (sum - all) / static_cast<double>(count - 1));
      problem.fixed.push_back(fixed);
      for (std::size_t r = 0; r < reflectors_.size(); ++r)
        problem.cost[r][m] -= m == base_ ? 0.0 : fixed;
    }
    return problem;
  }

  report::Table singleTable() {
    report::Table table;
    table.title = "Parts of L1_8bit, and the extra time of a reflector over the fastest method, ms";
    table.columns = {{"reflector", false}, {"pixels %", true}};
    for (const Setting& single : singles_) {
      table.columns.push_back({single.point.method, true});
      table.columns.push_back({"ms", true});
    }
    for (std::size_t r = 0; r < reflectors_.size(); ++r) {
      std::vector<std::string> row{
          reflectors_[r].name,
          report::fixedText(100.0 * static_cast<double>(reflectors_[r].pixels) / allPixels(), 2)};
      for (std::size_t m = 0; m < singles_.size(); ++m) {
        row.push_back(report::fixedText(errorOf(singles_[m], reflectors_[r]), 3));
        row.push_back(std::isfinite(marginal_[r][m]) ? report::fixedText(1e3 * marginal_[r][m], 2)
                                                     : "cannot");
      }
      table.rows.push_back(row);
    }
    table.rows.emplace_back();
    std::vector<std::string> all{"whole frame", ""};
    for (std::size_t m = 0; m < singles_.size(); ++m) {
      all.push_back(report::fixedText(pooled(singles_[m]), 3));
      all.push_back(report::fixedText(1e3 * seconds_[m], 2));
    }
    table.rows.push_back(all);
    return table;
  }

  /// The mixture beside the fastest single method that is accurate enough.
  void decide(const std::optional<Setting>& mixture, const std::optional<std::vector<int>>& choice,
              MixtureResult& result) {
    std::optional<std::size_t> single;
    for (std::size_t m = 0; m < singles_.size(); ++m)
      if (pooled(singles_[m]) <= bound_.limit && (!single || seconds_[m] < seconds_[*single]))
        single = m;
    if (!mixture) {
      if (single) result.best = singles_[*single];
      result.text = single ? "No mixture satisfies " + bound_.text + "; " +
                                 singles_[*single].point.method + " alone does.\n"
                           : "Nothing satisfies " + bound_.text + ".\n";
      return;
    }
    result.best = mixture;
    report::Table table;
    table.title = "The mixture";
    table.columns = {{"reflector", false}, {"method", false}};
    for (std::size_t r = 0; r < reflectors_.size(); ++r)
      table.rows.push_back(
          {reflectors_[r].name, singles_[static_cast<std::size_t>((*choice)[r])].point.method});
    table.notes.push_back("All others: " + singles_[base_].point.method + ".");
    result.text = "The mixture's " + std::string(kMetric) + " is " +
                  report::fixedText(pooled(*mixture), 3) + " on all frames: " + bound_.text +
                  " holds.";
    if (std::ranges::all_of(*choice, [&](int m) { return m == choice->front(); }))
      result.text += " It is one method for every reflector: " +
                     singles_[static_cast<std::size_t>(choice->front())].point.method + ".";
    if (single && singles_[*single].key != mixture->key) {
      const Samples& samples = bench_.measure({singles_[*single], *mixture}, timed_, false);
      const Ratio ratio =
          pairedRatio(samples.measurement.times(*samples.find(mixture->key), time_),
                      samples.measurement.times(*samples.find(singles_[*single].key), time_));
      const std::string name = singles_[*single].point.method;
      result.text += " It takes " + ratioText(ratio) + " times as long as " + name +
                     ", the fastest single method that satisfies it (" +
                     report::fixedText(pooled(singles_[*single]), 3) + ").";
      if (verdictOf(ratio) != TimeVerdict::Faster && ratio.value > 1.0) {
        result.best = singles_[*single];
        result.text += " So " + name + " alone is chosen.";
      }
    } else if (!single) {
      result.text += " No single method satisfies it.";
    }
    result.text += "\n";
    result.tables.push_back(std::move(table));
  }

  Bench& bench_;
  Bound bound_;
  TimeKind time_;
  std::vector<Setting> singles_;
  std::vector<double> seconds_;  ///< by single method
  std::size_t base_ = 0;         ///< the fastest
  std::vector<int> frames_;
  std::vector<int> timed_;
  std::vector<Reflector> reflectors_;
  std::vector<std::vector<double>> marginal_;
};

}  // namespace

MixtureResult tuneReflectors(Bench& bench, const std::vector<std::string>& methods,
                             const Bound& bound, const TimeKind& time) {
  if (bound.kind != Bound::Kind::Error || bound.metric != kMetric || bound.everyFrame)
    throw UsageError(
        "--per-reflector needs a bound on the mean error, as in --max-error 'L1_8bit<=2', because "
        "only a mean error can be divided among reflectors");
  if (methods.size() < 2)
    throw UsageError("--per-reflector needs two methods or more; give them by --method");
  return ReflectorTuning(bench, methods, bound, time).run();
}

}  // namespace catoptric::study
