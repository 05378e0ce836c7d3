#include "methods/contract/method.h"

namespace catoptric::methods {

Counters zeros(const std::vector<CounterInfo>& counters) {
  Counters all;
  for (const CounterInfo& counter : counters)
    if (counter.onlyWith.empty()) all[counter.name] = 0;
  return all;
}

}  // namespace catoptric::methods
