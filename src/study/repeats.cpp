#include "study/repeats.h"

#include <algorithm>

#include "config/json_text.h"
#include "core/error.h"
#include "core/file.h"
#include "core/text.h"
#include "report/table.h"
#include "report/timings.h"

namespace catoptric::study {
namespace {

std::string milliseconds(double seconds) {
  return seconds > 0.0 ? report::fixedText(1e3 * seconds, 2) : "";
}

/// All steps of the settings, the longest of the first setting first.
std::vector<std::string> stepsOf(const Measurement& measurement) {
  std::vector<std::string> steps;
  for (std::size_t i = 0; i < measurement.settings.size(); ++i)
    for (const std::string& step : measurement.steps(i))
      if (std::find(steps.begin(), steps.end(), step) == steps.end()) steps.push_back(step);
  return steps;
}

/// A time of the settings in ms, and its ratios to that of `base`.
std::vector<std::string> timesRow(const Measurement& measurement,
                                  const std::vector<std::size_t>& measured,
                                  const std::optional<std::size_t>& base, const TimeKind& kind) {
  std::vector<std::string> row{timeName(kind)};
  for (const std::size_t i : measured) {
    row.push_back(milliseconds(measurement.seconds(i, kind)));
    row.push_back(
        base ? ratioText(pairedRatio(measurement.times(i, kind), measurement.times(*base, kind)))
             : "");
  }
  return row;
}

}  // namespace

std::string ratioMethod(const run::RunConfig& run, const std::string& ratioTo) {
  std::vector<std::string> names;
  for (const run::MethodConfig& method : run.methods) names.push_back(method.name);
  const auto has = [&](const std::string& name) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  if (!ratioTo.empty()) {
    if (!has(ratioTo))
      throw UsageError("--ratio-to \"" + ratioTo + "\": the run has no such method" +
                       didYouMean(ratioTo, names) + "; it has " + joined(names, ", "));
    return ratioTo;
  }
  for (const char* name : {"traced", "reference"})
    if (has(name)) return name;
  return names.front();
}

RepeatedTimes timeRepeats(Bench& bench, const run::RunConfig& run, const std::string& base,
                          int amortize) {
  std::vector<Setting> settings;
  for (const run::MethodConfig& method : run.methods)
    settings.push_back(bench.prepare({method.name, {}, "", ""}));
  const Samples& samples = bench.measure(settings, bench.frames(settings.front()), false);

  const Measurement& measurement = samples.measurement;
  const TimeKind first{Clock::Wall, TimeKind::Of::First};
  const TimeKind mean{Clock::Wall, TimeKind::Of::Mean,
                      amortize > 0 ? amortize : bench.pathFrames(settings.front())};
  std::size_t rounds = 0;
  for (std::size_t i = 0; i < samples.keys.size(); ++i)
    rounds = std::max(rounds, measurement.times(i).size());
  report::Table table;
  table.title = "Ms per frame, the mean of the frames' medians over up to " +
                std::to_string(rounds) + " interleaved rounds; x: time divided by that of " + base +
                ", with the 95 % confidence interval";
  table.columns = {{"step", false}};
  std::vector<std::string> methods;
  std::vector<std::size_t> measured;
  const auto ofBase = std::find_if(settings.begin(), settings.end(), [&](const auto& setting) {
    return setting.point.method == base;
  });
  const std::optional<std::size_t> baseIndex = samples.find(ofBase->key);
  for (const Setting& setting : settings) {
    const std::optional<std::size_t> i = samples.find(setting.key);
    if (!i) {
      table.notes.push_back(setting.point.method + " failed: " + bench.failures().at(setting.key));
      continue;
    }
    measured.push_back(*i);
    table.columns.push_back({setting.point.method, true});
    table.columns.push_back({"x", false});
    const Ratio ratio =
        baseIndex ? pairedRatio(measurement.times(*i), measurement.times(*baseIndex)) : Ratio{};
    config::JsonText text;
    text.add("name", setting.point.method)
        .add("seconds", measurement.seconds(*i, {}))
        .add("first_seconds", measurement.seconds(*i, first))
        .add("mean_seconds", measurement.seconds(*i, mean))
        .add("ratio", ratio.value);
    if (ratio.interval)
      text.raw("ratio_interval", "[" + config::numberText(ratio.interval->low) + "," +
                                     config::numberText(ratio.interval->high) + "]");
    methods.push_back(text.object());
  }
  for (const std::string& step : stepsOf(measurement)) {
    std::vector<std::string> row{step};
    for (const std::size_t i : measured) {
      row.push_back(milliseconds(frameSeconds(measurement.stepTimes(i, step)).mean));
      row.emplace_back();
    }
    table.rows.push_back(row);
  }
  table.rows.emplace_back();
  for (const TimeKind::Of of : {TimeKind::Of::Steady, TimeKind::Of::Reflection})
    table.rows.push_back(timesRow(measurement, measured, baseIndex, {Clock::Wall, of}));
  for (const TimeKind& kind : {first, mean}) {
    std::vector<std::string> row{timeName(kind)};
    for (const std::size_t i : measured) {
      row.push_back(milliseconds(measurement.seconds(i, kind)));
      row.emplace_back();
    }
    table.rows.push_back(row);
  }
  table.notes.emplace_back(report::kFirstFrames);
  if (bench.options().repeats < kLeastRounds)
    table.notes.push_back("Fewer than " + std::to_string(kLeastRounds) +
                          " rounds give no confidence interval.");
  report::writeTables(bench.options().folder, "table", std::span(&table, 1));
  return {report::toText(table), config::JsonText()
                                     .add("repeats", rounds)
                                     .add("ratio_to", base)
                                     .add("amortize", mean.amortize)
                                     .raw("methods", "[" + joined(methods, ",") + "]")
                                     .object()};
}

}  // namespace catoptric::study
