// What the steps of the timing tables mean.
#pragma once

#include <string>
#include <vector>

namespace catoptric::run {

struct StepMeaning {
  std::string name;
  std::string when;  ///< "start", "frames", "beside" (by the writers, beside rendering)
  std::string meaning;
};

/// Steps of the program and of its simple methods, in the order in which they happen.
const std::vector<StepMeaning>& stepMeanings();

}  // namespace catoptric::run
