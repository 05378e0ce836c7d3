// tune: settings of methods measured by a bench, and what becomes of it.
#pragma once

#include <optional>
#include <vector>

#include "report/table.h"
#include "study/bench.h"
#include "study/tune.h"

namespace catoptric::study {

/// Times that bounds on time are judged by.
struct TuneTimes {
  Measurement::Clock clock = Measurement::Clock::Wall;
  double budgetSeconds = 0.0;     ///< after which nothing new is tried; 0: no end
  std::optional<Setting> timeOf;  ///< the method that the bound counts in
};

/// tune() of settings whose frames and times the bench measures. Throws StudyStopped.
TuneResult tuneSettings(Bench& bench, const std::vector<Setting>& settings, const TuneTimes& times,
                        const TuneOptions& options);

/// The tried settings, a row each.
report::Table trialTable(const TuneResult& result, const std::vector<Setting>& settings,
                         const std::string& metric);

/// Writes trials.jsonl and samples.csv into the bench's folder.
void writeTrials(const Bench& bench, const TuneResult& result,
                 const std::vector<Setting>& settings);

/// Writes the run config of one setting, tuned.json, with what is known of it as its comment.
void writeTunedConfig(const Setting& setting, const std::filesystem::path& folder,
                      const std::string& evidence);

}  // namespace catoptric::study
