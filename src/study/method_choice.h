// Which method for which reflector: with one bounce a reflector's error depends on its own method
// alone, so that one whole render by each method fills the table of errors.
#pragma once

#include <optional>
#include <vector>

namespace catoptric::study {

struct MixtureProblem {
  /// By reflector, then by method: its share of the error; infinite: the method cannot do it.
  std::vector<std::vector<double>> error;
  /// Likewise: seconds that a frame takes longer for it.
  std::vector<std::vector<double>> cost;
  /// Seconds that a method takes as soon as it fills one reflector.
  std::vector<double> fixed;
  double mostError = 0.0;  ///< of all together
};

/// The cheapest choice of a method for each reflector within the error: exact (multiple-choice
/// knapsack, by dynamic programming over the pairs of error and cost that nothing else beats, for
/// each set of methods). None: no choice is accurate enough.
std::optional<std::vector<int>> cheapestMixture(const MixtureProblem& problem);

}  // namespace catoptric::study
