// Finds the Pareto-optimal settings with respect to time and error. Comparisons that are
// inconclusive are reported separately.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "study/statistics.h"

namespace catoptric::study {

enum class Mark {
  Front,      ///< no other setting is as accurate and as fast
  Dominated,  ///< another setting is at least as accurate, and faster with confidence
  Unclear,    ///< another setting may be at least as accurate and faster; this is inconclusive
  Unmeasured  ///< its time or its error is missing
};
const char* markName(Mark mark);

struct Judged {
  Mark mark = Mark::Unmeasured;
  int by = -1;  ///< the setting that dominates it, or may dominate it
};

/// `errors`: one exact error per setting, less is better; NaN: not known. `uncertainty`: of the
/// reference; which of two errors up to it is smaller, is not known, so that neither setting
/// dominates the other. `timeRatio(a, b)`: the time of a divided by that of b.
std::vector<Judged> judge(const std::vector<double>& errors, double uncertainty,
                          const std::function<Ratio(std::size_t, std::size_t)>& timeRatio);

}  // namespace catoptric::study
