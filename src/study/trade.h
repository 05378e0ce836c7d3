// Which settings are worth having: time against error, with what is not known kept apart.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "study/statistics.h"

namespace catoptric::study {

enum class Mark {
  Front,      ///< nothing else is as accurate and as fast
  Dominated,  ///< something else is as accurate or more, and surely faster
  Unclear,    ///< something else is as accurate or more; which of both is faster cannot be told
  Unmeasured  ///< it has no time or no error
};
const char* markName(Mark mark);

struct Judged {
  Mark mark = Mark::Unmeasured;
  int by = -1;  ///< the setting that dominates it, or may
};

/// `errors`: one for each setting, less is better, exact; NaN: none. `timeRatio(a, b)`: how many
/// times as long a takes as b.
std::vector<Judged> judge(const std::vector<double>& errors,
                          const std::function<Ratio(std::size_t, std::size_t)>& timeRatio);

}  // namespace catoptric::study
