// render --repeats: times the methods of a run, interleaved.
#pragma once

#include <string>

#include "study/bench.h"

namespace catoptric::study {

/// The method to which ratios refer: `ratioTo`, otherwise traced, otherwise reference, otherwise
/// the first. Throws UsageError for a method that the run does not have.
std::string ratioMethod(const run::RunConfig& run, const std::string& ratioTo);

struct RepeatedTimes {
  std::string text;
  std::string json;
};

/// Times all methods of the run, interleaved. The times and the table are stored in the bench's
/// folder. `amortize`: as TimeKind::amortize; 0: the frames of the path.
RepeatedTimes timeRepeats(Bench& bench, const run::RunConfig& run, const std::string& base,
                          int amortize);

}  // namespace catoptric::study
