#include "study/tune_settings.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "config/json_text.h"
#include "core/error.h"
#include "core/file.h"

namespace catoptric::study {
namespace {

/// The settings of a study, measured by its bench.
class BenchWorld : public TuneWorld {
 public:
  BenchWorld(Bench& bench, const std::vector<Setting>& settings, const Bound& bound,
             const TuneTimes& times)
      : bench_(bench), settings_(settings), bound_(bound), times_(times) {}

  std::vector<double> errors(std::size_t i, const std::vector<int>& frames) override {
    // Frame by frame where the time may be over: what is rendered then is known
    if (bench_.options().outOfTime) try {
        for (const int frame : frames) bench_.findErrors({settings_[i]}, {frame});
      } catch (const BudgetSpent&) {
      }
    else
      bench_.findErrors({settings_[i]}, frames);
    std::vector<double> values;
    bool measured = false;
    for (const int frame : frames) {
      const auto& known = bench_.errors(settings_[i]).frames;
      const auto found = known.find(frame);
      if (found == known.end()) return {};
      const auto value = found->second.metrics.find(bound_.metric);
      const bool has = value != found->second.metrics.end();
      measured = measured || has;
      values.push_back(has ? value->second : 0.0);  // the path's first frame has no flicker
    }
    if (!measured)
      throw UsageError("no frame has " + bound_.metric + ": " +
                       (bound_.metric == kFlicker
                            ? "it needs a frame before it; ask for more frames"
                            : "the reference or the frames lack a layer for it"));
    return values;
  }

  double pooled(std::size_t i, const std::vector<int>& frames) override {
    return bench_.errors(settings_[i]).pooled(bound_.metric, frames);
  }

  std::map<std::size_t, MeasuredTime> times(const std::vector<std::size_t>& of,
                                            const std::vector<int>& frames,
                                            int measurements) override {
    std::map<std::size_t, MeasuredTime> result;
    // All batches have the same setting among them: their times are made from ratios to it.
    const Setting base = times_.timeOf ? *times_.timeOf : settings_[of.front()];
    for (std::size_t next = 0; next < of.size();) {
      std::vector<Setting> batch{base};
      std::vector<std::size_t> ofBatch;
      while (next < of.size() && batch.size() < std::max<std::size_t>(2, bench_.capacity())) {
        ofBatch.push_back(of[next]);
        if (settings_[of[next++]].key != base.key) batch.push_back(settings_[ofBatch.back()]);
      }
      std::map<std::string, PairedTimes> all;
      try {
        all = measured(batch, frames, measurements);
      } catch (const BudgetSpent&) {
        return result;
      }
      if (!all.contains(base.key)) continue;
      if (baseSeconds_[base.key] == 0.0)
        baseSeconds_[base.key] = frameSeconds(all.at(base.key).times).mean;
      for (const std::size_t i : ofBatch) {
        const auto at = all.find(settings_[i].key);
        if (at == all.end()) continue;
        const auto& [own, ofBase] = at->second;
        const Ratio ratio = pairedRatio(own, ofBase);
        const double seconds = baseSeconds_[base.key] * ratio.value;
        const RoundTimes second(own.size(), std::vector<double>(own.front().size(), 1.0));
        result[i] = {seconds, times_.timeOf ? ratio : pairedRatio(own, second)};
      }
    }
    return result;
  }

  bool outOfTime() const override {
    return bench_.options().outOfTime && bench_.options().outOfTime();
  }

  double errorSoFar(std::size_t i) override {
    std::vector<int> frames;
    for (const auto& [number, frame] : bench_.errors(settings_[i]).frames) frames.push_back(number);
    return bench_.errors(settings_[i]).pooled(bound_.metric, frames);
  }

  std::size_t together() const override { return bench_.capacity(); }

 private:
  /// Times by key and those of the batch's first setting, of so many measurements together; what
  /// was measured by this or an earlier process is taken as it is.
  std::map<std::string, PairedTimes> measured(const std::vector<Setting>& batch,
                                              const std::vector<int>& frames, int measurements) {
    std::map<std::string, PairedTimes> times;
    const auto join = [&](const Samples& samples) {
      const auto base = samples.find(batch.front().key);
      if (!base) return;
      const RoundTimes ofBase = samples.measurement.times(*base, times_.kind);
      for (const Setting& setting : batch)
        if (const auto at = samples.find(setting.key))
          times[setting.key].add(samples.measurement.times(*at, times_.kind), ofBase);
    };
    for (const Samples& samples : bench_.samples())
      if (measurements > 0 && samples.serve(frames, bench_.options()) &&
          samples.repeats >= bench_.options().repeats &&
          std::ranges::all_of(batch, [&](const Setting& setting) {
            return samples.find(setting.key).has_value();
          })) {
        join(samples);
        --measurements;
      }
    for (; measurements > 0; --measurements) join(bench_.measure(batch, frames, false));
    return times;
  }

  Bench& bench_;
  const std::vector<Setting>& settings_;
  const Bound& bound_;
  const TuneTimes& times_;
  std::map<std::string, double> baseSeconds_;
};

/// The point's place in its method's lattice.
std::vector<Candidate> candidatesOf(const std::vector<Setting>& settings) {
  std::vector<std::string> methods;
  std::map<std::string, std::map<std::string, std::vector<std::string>>> values;
  std::vector<Candidate> candidates;
  for (const auto& [point, run, key] : settings) {
    auto method = std::find(methods.begin(), methods.end(), point.method);
    if (method == methods.end()) method = methods.insert(method, point.method);
    Candidate candidate{static_cast<int>(method - methods.begin()), {}};
    for (const auto& [name, value] : point.settings) {
      std::vector<std::string>& known = values[point.method][name];
      const auto at = std::find(known.begin(), known.end(), value);
      candidate.values.push_back(static_cast<int>(at - known.begin()));
      if (at == known.end()) known.push_back(value);
    }
    candidates.push_back(std::move(candidate));
  }
  return candidates;
}

/// A run config of one setting, with what is known of it.
std::string tunedConfig(const Setting& setting, const std::filesystem::path& folder,
                        const std::string& evidence) {
  const config::Value all = config::parseText(setting.run.effective, "effective config");
  const auto relative = [&](const std::string& name) {
    return std::filesystem::proximate(name, folder).generic_string();
  };
  const config::Value entry = all.get("methods").asArray().front();
  config::JsonText method;
  method.add("method", entry.get("method").asString()).add("name", entry.get("name").asString());
  for (const std::string& name : entry.get("options").keys())
    method.raw(name, entry.get("options").get(name).dump());
  if (entry.has("reflectors")) {
    config::JsonText rules;
    for (const std::string& reflector : entry.get("reflectors").keys()) {
      const config::Value rule = entry.get("reflectors").get(reflector);
      config::JsonText one;
      one.add("method", rule.get("method").asString());
      for (const std::string& name : rule.get("options").keys())
        one.raw(name, rule.get("options").get(name).dump());
      rules.raw(reflector, one.object());
    }
    method.raw("reflectors", rules.object());
  }
  config::JsonText text;
  text.raw("comment", evidence).add("scene", relative(all.get("scene").asString()));
  if (!all.get("path").asString().empty()) text.add("path", relative(all.get("path").asString()));
  if (all.has("camera")) text.add("camera", all.get("camera").asString());
  if (all.has("missing_textures"))
    text.add("missing_textures", all.get("missing_textures").asString());
  if (!all.get("environment").asString().empty())
    text.add("environment", all.get("environment").asString());
  return text.add("frames", all.get("frames").asString())
             .raw("image", all.get("image").dump())
             .raw("methods", "[" + method.object() + "]")
             .raw("seed", all.get("seed").dump())
             .object() +
         "\n";
}

}  // namespace

std::string tuneForecast(const std::vector<Setting>& settings, const std::vector<int>& frames,
                         int repeats) {
  std::string text;
  for (const Setting& setting : settings) text += setting.text() + "\n";
  const std::size_t screened = screenedFirst(candidatesOf(settings)).size();
  const std::size_t looked = screenFrames(frames).size();
  return text + std::to_string(settings.size()) + " combinations. First, " +
         std::to_string(screened) + " that differ in one option are measured on " +
         std::to_string(looked) + " of " + std::to_string(frames.size()) +
         " frames: " + std::to_string(screened * looked * (static_cast<std::size_t>(repeats) + 2)) +
         " frames to render, and those of the reference. Then the most promising ones are "
         "measured, and the best is verified\n";
}

TuneResult tuneSettings(Bench& bench, const std::vector<Setting>& settings, const TuneTimes& times,
                        const TuneOptions& options) {
  BenchWorld world(bench, settings, options.bound, times);
  return tune(candidatesOf(settings), world, options);
}

report::Table trialTable(const TuneResult& result, const std::vector<Setting>& settings,
                         const std::string& metric, const TimeKind& time) {
  report::Table table;
  table.columns = {{"stage", false},
                   {"setting", false},
                   {"frames", true},
                   {metric, true},
                   {"ms, " + timeName(time), true},
                   {"", false}};
  for (const Trial& trial : result.trials)
    table.rows.push_back({trial.stage, settings[trial.candidate].text(),
                          std::to_string(trial.frames), report::fixedText(trial.error, 3),
                          report::fixedText(1e3 * trial.seconds, 1), trial.verdict});
  return table;
}

Chart trialChart(const TuneResult& result, const std::vector<Setting>& settings, const Bound& bound,
                 const TimeKind& time) {
  Chart chart;
  chart.title = "Tuned for " + bound.text;
  chart.note =
      "Filled: the result. Each with its last time, and the error on the frames of that trial";
  chart.xTitle = "ms, " + timeName(time);
  chart.yTitle = bound.metric;
  chart.xLog = chart.yLog = true;
  if (bound.kind == Bound::Kind::Error) chart.yBound = bound.limit;
  if (bound.kind == Bound::Kind::Time && bound.timeOf.empty()) chart.xBound = 1e3 * bound.limit;
  std::map<std::size_t, const Trial*> last;
  for (const Trial& trial : result.trials)  // times of proposals are predicted
    if (trial.stage != "propose" && std::isfinite(trial.error) && std::isfinite(trial.seconds))
      last[trial.candidate] = &trial;
  std::map<std::string, ChartSeries> series;
  for (const auto& [candidate, trial] : last) {
    const Point& setting = settings[candidate].point;
    ChartPoint point;
    point.x = 1e3 * trial->seconds;
    point.y = trial->error;
    point.mark = Mark::Dominated;
    if (result.best == candidate) {
      point.mark = Mark::Front;
      point.label = settingsText(setting.settings);
    }
    point.title = settings[candidate].text() + ": " + report::fixedText(point.x, 1) + " ms, " +
                  bound.metric + " " + report::fixedText(point.y, 3);
    series[setting.method].name = setting.method;
    series[setting.method].points.push_back(point);
  }
  for (auto& [method, one] : series) {
    // Clang 14 can't compile the library's std::ranges::stable_partition
    std::stable_partition(one.points.begin(), one.points.end(),
                          [](const ChartPoint& point) { return point.mark != Mark::Front; });
    chart.series.push_back(std::move(one));
  }
  return chart;
}

void writeTrials(const Bench& bench, const TuneResult& result,
                 const std::vector<Setting>& settings) {
  std::string trials;
  for (const Trial& trial : result.trials)
    trials += config::JsonText()
                  .add("stage", trial.stage)
                  .add("setting", settings[trial.candidate].text())
                  .add("frames", trial.frames)
                  .add("error", trial.error)
                  .add("seconds", trial.seconds)
                  .add("verdict", trial.verdict)
                  .object() +
              "\n";
  writeFileAtomically(bench.options().folder / "trials.jsonl", std::string_view(trials));
  bench.writeSamples();
}

void writeTunedConfig(const Setting& setting, const std::filesystem::path& folder,
                      const std::string& evidence) {
  writeFileAtomically(folder / "tuned.json",
                      std::string_view(tunedConfig(setting, folder, config::jsonString(evidence))));
}

}  // namespace catoptric::study
