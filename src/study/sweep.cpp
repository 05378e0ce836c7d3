#include "study/sweep.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "core/error.h"
#include "methods/contract/method.h"
#include "report/table.h"
#include "run/stage/steps.h"

namespace catoptric::study {
namespace {

/// Indices of the points of each group, in the order of the first ones.
std::vector<std::vector<std::size_t>> groupsOf(const std::vector<Setting>& settings) {
  std::vector<std::vector<std::size_t>> groups;
  std::map<std::string, std::size_t> known;
  for (std::size_t i = 0; i < settings.size(); ++i) {
    const auto [at, isNew] = known.emplace(settings[i].point.group, groups.size());
    if (isNew) groups.emplace_back();
    groups[at->second].push_back(i);
  }
  return groups;
}

/// The point to which the others of a group are compared.
std::size_t measureOf(const std::vector<Setting>& settings, const std::vector<std::size_t>& group,
                      const SweepRequest& request) {
  for (const std::size_t i : group)
    if (settings[i].point.method == request.ratioTo) return i;
  return group.front();
}

void addTimes(const Bench& bench, const SweepRequest& request, const std::string& measure,
              const std::vector<int>& frames, SweepPoint& point) {
  const Samples* samples = bench.timesBeside(point.setting.key, measure, frames);
  if (samples == nullptr) return;
  const std::size_t own = *samples->find(point.setting.key);
  const Measurement& measurement = samples->measurement;
  point.ratio = pairedRatio(measurement.times(own, request.time),
                            measurement.times(*samples->find(measure), request.time));
  point.seconds = measurement.seconds(own, request.time);
  const auto secondsOf = [&](TimeKind::Of of) {
    return measurement.seconds(own, {request.time.clock, of, request.time.amortize});
  };
  point.first = secondsOf(TimeKind::Of::First);
  point.mean = secondsOf(TimeKind::Of::Mean);
  point.reflection = secondsOf(TimeKind::Of::Reflection);
  const FrameSeconds seconds = frameSeconds(measurement.times(own, {request.time.clock}));
  point.steady = seconds.mean;
  point.worstSeconds = seconds.worst;
  if (seconds.worstFrame >= 0)
    point.worstSecondsFrame = frames[static_cast<std::size_t>(seconds.worstFrame)];
  for (const std::string& step : measurement.steps(own))
    point.steps[step] = frameSeconds(measurement.stepTimes(own, step)).mean;
}

/// How many times as long point a takes as b: measured beside each other, or both beside the
/// group's measure.
Ratio ratioOf(const Bench& bench, const SweepRequest& request, const SweepPoint& a,
              const SweepPoint& b, const std::vector<int>& frames) {
  const Samples* samples = bench.timesBeside(a.setting.key, b.setting.key, frames);
  if (samples == nullptr) return quotient(a.ratio, b.ratio);
  const Measurement& measurement = samples->measurement;
  return pairedRatio(measurement.times(*samples->find(a.setting.key), request.time),
                     measurement.times(*samples->find(b.setting.key), request.time));
}

bool samePixels(const PointErrors& a, const PointErrors& b, const std::vector<int>& frames) {
  return std::all_of(frames.begin(), frames.end(), [&](int number) {
    const auto one = a.frames.find(number);
    const auto other = b.frames.find(number);
    return one != a.frames.end() && other != b.frames.end() &&
           one->second.pixels == other->second.pixels;
  });
}

/// What differs between two points of one method, as far as it is one option.
std::string onlyDifference(const Point& a, const Point& b) {
  std::string name;
  if (a.method != b.method || a.settings.size() != b.settings.size()) return "";
  for (std::size_t i = 0; i < a.settings.size(); ++i) {
    if (a.settings[i] == b.settings[i]) continue;
    if (!name.empty()) return "";
    name = a.settings[i].first;
  }
  return name;
}

/// Says how far the reference itself is off.
void noteUncertainty(SweepResult& result) {
  double least = std::numeric_limits<double>::infinity();
  double most = 0.0;
  bool within = false;
  for (const SweepPoint& point : result.points) {
    if (!(point.uncertainty > 0.0)) continue;
    least = std::min(least, point.uncertainty);
    most = std::max(most, point.uncertainty);
    within = within || point.withinUncertainty(result.request.metrics.front());
  }
  if (most == 0.0) return;
  result.notes.push_back(
      "The standard error of " + result.request.against + " is " + report::fixedText(least, 3) +
      (most > least ? " to " + report::fixedText(most, 3) : "") + " in " +
      result.request.metrics.front() +
      (within ? ". Points marked \"within\" have no larger error: they may be more exact than "
                "the reference, and which of them is the most exact, it cannot tell."
              : "."));
}

/// Says which options change nothing, wherever they alone differ.
void noteEffects(SweepResult& result) {
  std::map<std::string, std::pair<int, int>>
      pairs;  // option: pairs of points, those that are equal
  for (const SweepPoint& a : result.points)
    for (const SweepPoint& b : result.points) {
      if (b.number <= a.number || !a.failure.empty() || !b.failure.empty()) continue;
      const std::string name = onlyDifference(a.setting.point, b.setting.point);
      if (name.empty()) continue;
      auto& [all, equal] = pairs[name];
      ++all;
      if (std::find(a.sameAs.begin(), a.sameAs.end(), b.number) != a.sameAs.end()) ++equal;
    }
  for (const auto& [name, counts] : pairs)
    if (counts.second == counts.first)
      result.notes.push_back(name +
                             " has no effect on these frames: all its values give the same "
                             "pixels.");
}

/// Adds the names of the counters with CounterInfo::handedOn.
void addHandedOn(const run::MethodConfig& method, std::set<std::string>& names) {
  const auto add = [&](const std::string& id) {
    for (const methods::CounterInfo& counter :
         methods::findMethod(methods::registry(), id)->counters)
      if (counter.handedOn) names.insert(counter.name);
  };
  add(method.id);
  for (const run::ReflectorRule& rule : method.reflectors) add(rule.id);
  for (const run::MethodConfig& fallback : method.fallback) addHandedOn(fallback, names);
}

/// What SweepPoint::handedOn says.
double handedOn(const Setting& setting, const PointErrors& errors, const std::vector<int>& frames) {
  std::set<std::string> names;
  for (const methods::CounterInfo& counter : run::pipelineCounters())
    if (counter.handedOn) names.insert(counter.name);
  addHandedOn(setting.run.methods.front(), names);
  double samples = 0.0;
  for (const std::string& name : names) samples += errors.meanCounter(name, frames);
  const methods::RunSettings& image = setting.run.image;
  return samples /
         (static_cast<double>(image.width) * image.height * image.samples * image.samples);
}

void judgeGroup(const Bench& bench, const std::vector<std::size_t>& group,
                const std::vector<int>& frames, SweepResult& result) {
  std::vector<double> errors;
  double uncertainty = 0.0;  // of one reference for the group
  for (const std::size_t i : group) {
    const SweepPoint& point = result.points[i];
    uncertainty = std::max(uncertainty, point.uncertainty);
    const auto error = point.errors.find(result.request.metrics.front());
    errors.push_back(point.seconds > 0.0 && error != point.errors.end()
                         ? error->second
                         : std::numeric_limits<double>::quiet_NaN());
  }
  const std::vector<Judged> judged = judge(errors, uncertainty, [&](std::size_t a, std::size_t b) {
    return ratioOf(bench, result.request, result.points[group[a]], result.points[group[b]], frames);
  });
  for (std::size_t k = 0; k < group.size(); ++k) {
    result.points[group[k]].judged = judged[k];
    if (judged[k].by >= 0)
      result.points[group[k]].judged.by =
          static_cast<int>(group[static_cast<std::size_t>(judged[k].by)]);
  }
}

}  // namespace

void runSweep(Bench& bench, const SweepRequest& request, const std::vector<Setting>& settings) try {
  for (const std::vector<std::size_t>& group : groupsOf(settings)) {
    const Setting& measure = settings[measureOf(settings, group, request)];
    const std::vector<int>& frames = bench.frames(measure);
    std::vector<Setting> own;
    for (const std::size_t i : group) own.push_back(settings[i]);
    if (bench.options().repeats == 0) {
      bench.findErrors(own, frames);
      continue;
    }
    bench.measureBeside(measure, own, frames);
    bench.findErrors(own, frames);  // of points whose times were known
  }
} catch (const BudgetSpent&) {  // evaluateSweep() says what is missing
}

SweepResult evaluateSweep(Bench& bench, const SweepRequest& request,
                          const std::vector<Setting>& settings) {
  SweepResult result{request, {}, bench.frames(settings.front()), {}};
  for (const Setting& setting : settings) {
    result.points.emplace_back().setting = setting;
    result.points.back().number = static_cast<int>(result.points.size());
  }
  int unmeasured = 0;
  for (const std::vector<std::size_t>& group : groupsOf(settings)) {
    const Setting& measure = settings[measureOf(settings, group, request)];
    const std::vector<int>& frames = bench.frames(measure);
    for (const std::size_t i : group) {
      SweepPoint& point = result.points[i];
      const auto failure = bench.failures().find(point.setting.key);
      if (failure != bench.failures().end()) {
        point.failure = failure->second;
        continue;
      }
      if (!bench.knowsErrors(point.setting, frames) ||
          (bench.options().repeats > 0 &&
           !bench.knowsTimes(point.setting.key, measure.key, frames)))
        ++unmeasured;
      addTimes(bench, request, measure.key, frames, point);
      const PointErrors& errors = bench.errors(point.setting);
      point.uncertainty = errors.uncertainty(request.metrics.front(), frames);
      for (const std::string& metric : request.metrics) {
        const double pooled = errors.pooled(metric, frames);
        if (std::isnan(pooled)) continue;
        point.errors[metric] = pooled;
        const int worst = errors.worstFrame(metric, frames);
        point.worst[metric] = {worst, errors.frames.at(worst).metrics.at(metric)};
        point.least[metric] = point.worst[metric].second;
        for (const int frame : frames)
          if (const auto& all = errors.frames.at(frame).metrics; all.contains(metric))
            point.least[metric] = std::min(point.least[metric], all.at(metric));
      }
      point.handedOn = handedOn(point.setting, errors, frames);
      for (const std::size_t j : group)
        if (j != i && samePixels(errors, bench.errors(settings[j]), frames))
          point.sameAs.push_back(static_cast<int>(j + 1));
    }
    judgeGroup(bench, group, frames, result);
  }
  noteUncertainty(result);
  noteEffects(result);
  const bool spent = bench.options().outOfTime && bench.options().outOfTime();
  if (unmeasured > 0 && !spent)
    result.notes.push_back(std::to_string(unmeasured) +
                           " points were not timed: the baseline of their ratios failed.");
  if (unmeasured > 0 && spent)
    result.notes.push_back(
        "The budget was spent: " + std::to_string(unmeasured) + " of " +
        std::to_string(settings.size()) + " points have no errors, or fewer than " +
        std::to_string(bench.options().repeats) + " rounds. --existing resume measures these.");
  if (std::ranges::any_of(result.points, [](const SweepPoint& point) {
        return point.seconds > 0.0 && point.ratio.rounds < kLeastRounds;
      }))
    result.notes.push_back("Fewer than " + std::to_string(kLeastRounds) +
                           " rounds give no confidence interval: every such pair is unclear.");
  return result;
}

}  // namespace catoptric::study
