// tune --per-reflector: chooses a method for each reflector.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "report/table.h"
#include "study/bench.h"
#include "study/tune.h"

namespace catoptric::study {

struct MixtureResult {
  std::optional<Setting> best;  ///< a mixture, or a single method if it is as fast
  std::string text;
  std::vector<report::Table> tables;
};

/// Finds the fastest assignment of methods to reflectors within the bound. Verifies it on all
/// frames, and times it together with the best single method. Needs the layer `id`. Throws
/// UsageError unless the bound is on the mean of L1_8bit.
MixtureResult tuneReflectors(Bench& bench, const std::vector<std::string>& methods,
                             const Bound& bound, const TimeKind& time);

}  // namespace catoptric::study
