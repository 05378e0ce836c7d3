// render --repeats: the methods of a run, timed in turns.
#pragma once

#include <string>

#include "study/bench.h"

namespace catoptric::study {

/// The method that ratios are to: `ratioTo`, else traced, else reference, else the first. Throws
/// UsageError for a method that the run has not.
std::string ratioMethod(const run::RunConfig& run, const std::string& ratioTo);

struct RepeatedTimes {
  std::string text;
  std::string json;
};

/// Times all methods of the run in turns; the samples and the table stay in the bench's folder.
RepeatedTimes timeRepeats(Bench& bench, const run::RunConfig& run, const std::string& base);

}  // namespace catoptric::study
