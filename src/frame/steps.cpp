#include "frame/steps.h"

#include <utility>

namespace catoptric::frame {

void StepTimer::beginFrame(int number) {
  frame_ = number;
  // The first frame of the process pays for caches and compilation.
  first_ = !anyFrame_;
  anyFrame_ = true;
}

void StepTimer::add(const std::string& step, double seconds, const std::string& clock) {
  samples_.push_back({frame_, prefix_ + step, seconds, clock, first_});
}

std::vector<StepSample> StepTimer::take() {
  return std::exchange(samples_, {});
}

}  // namespace catoptric::frame
