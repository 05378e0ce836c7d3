#include "study/trade.h"

#include <cmath>

namespace catoptric::study {

const char* markName(Mark mark) {
  switch (mark) {
    case Mark::Front:
      return "front";
    case Mark::Dominated:
      return "dominated";
    case Mark::Unclear:
      return "unclear";
    case Mark::Unmeasured:
      break;
  }
  return "unmeasured";
}

std::vector<Judged> judge(const std::vector<double>& errors, double uncertainty,
                          const std::function<Ratio(std::size_t, std::size_t)>& timeRatio) {
  std::vector<Judged> judged(errors.size());
  for (std::size_t i = 0; i < errors.size(); ++i) {
    if (std::isnan(errors[i])) continue;
    judged[i].mark = Mark::Front;
    for (std::size_t j = 0; j < errors.size(); ++j) {
      const bool bothWithin = errors[i] <= uncertainty && errors[j] <= uncertainty;
      if (j == i || std::isnan(errors[j]) || (errors[j] > errors[i] && !bothWithin)) continue;
      const TimeVerdict verdict = verdictOf(timeRatio(j, i));
      if (verdict == TimeVerdict::Slower) continue;
      if (verdict == TimeVerdict::Faster && (!bothWithin || errors[j] == errors[i])) {
        judged[i] = {Mark::Dominated, static_cast<int>(j)};
        break;
      }
      if (judged[i].mark == Mark::Front) judged[i] = {Mark::Unclear, static_cast<int>(j)};
    }
  }
  return judged;
}

}  // namespace catoptric::study
