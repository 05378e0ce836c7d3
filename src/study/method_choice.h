// Chooses a method for each reflector. With one bounce, a reflector's error depends only on its own
// method, so one whole render per method yields the complete table of errors.
#pragma once

#include <optional>
#include <vector>

namespace catoptric::study {

struct MixtureProblem {
  /// By reflector, then by method: the reflector's part of the error. Infinite: the method does not
  /// support it.
  std::vector<std::vector<double>> error;
  /// By reflector, then by method: the seconds that the reflector adds to a frame.
  std::vector<std::vector<double>> cost;
  /// By method: seconds per frame as soon as the method shades any reflector.
  std::vector<double> fixed;
  double mostError = 0.0;  ///< bound on the sum of the errors
};

/// The cheapest assignment of methods to reflectors within the error bound; nullopt if no
/// assignment is accurate enough. Exact: a multiple-choice knapsack problem per set of methods,
/// solved by dynamic programming over the Pareto-optimal pairs of error and cost.
std::optional<std::vector<int>> cheapestMixture(const MixtureProblem& problem);

}  // namespace catoptric::study
