// tune: measures the settings of methods with a bench, and writes the result.
#pragma once

#include <optional>
#include <vector>

#include "report/table.h"
#include "study/bench.h"
#include "study/chart.h"
#include "study/tune.h"

namespace catoptric::study {

/// How times are measured for time bounds.
struct TuneTimes {
  TimeKind kind;
  std::optional<Setting> timeOf;  ///< the method whose time is the unit of the bound
};

/// Runs tune() on settings whose frames and times the bench measures. Throws StudyStopped.
TuneResult tuneSettings(Bench& bench, const std::vector<Setting>& settings, const TuneTimes& times,
                        const TuneOptions& options);

/// What tuneSettings() would do at least, for --dry-run.
std::string tuneForecast(const std::vector<Setting>& settings, const std::vector<int>& frames,
                         int repeats);

/// A table with one row per tried setting.
report::Table trialTable(const TuneResult& result, const std::vector<Setting>& settings,
                         const std::string& metric, const TimeKind& time);

/// Time and error of all settings that were timed, with the bound.
Chart trialChart(const TuneResult& result, const std::vector<Setting>& settings, const Bound& bound,
                 const TimeKind& time);

/// Writes trials.jsonl and samples.csv to the bench's folder.
void writeTrials(const Bench& bench, const TuneResult& result,
                 const std::vector<Setting>& settings);

/// Writes tuned.json, the run config of one setting. `evidence` becomes its comment.
void writeTunedConfig(const Setting& setting, const std::filesystem::path& folder,
                      const std::string& evidence);

}  // namespace catoptric::study
