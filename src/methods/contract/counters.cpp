#include "methods/contract/method.h"

namespace catoptric::methods {

const char* stepKindName(StepKind kind) {
  switch (kind) {
    case StepKind::Rendering:
      return "rendering";
    case StepKind::Extras:
      return "extras";
    case StepKind::Rest:
      return "rest";
    case StepKind::Waiting:
      return "waiting";
    case StepKind::Check:
      return "check";
  }
  return "";
}

Counters zeros(const std::vector<CounterInfo>& counters) {
  Counters all;
  for (const CounterInfo& counter : counters)
    if (counter.onlyWith.empty()) all[counter.name] = 0;
  return all;
}

}  // namespace catoptric::methods
