#include "study/method_choice.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace catoptric::study {
namespace {

/// A choice for the first reflectors.
struct State {
  double error = 0.0;
  double cost = 0.0;
  int method = -1;
  std::size_t before = 0;  ///< index of the choice for the reflectors before
};

/// Keeps what nothing else beats in both, by rising error.
void prune(std::vector<State>& states) {
  std::sort(states.begin(), states.end(), [](const State& a, const State& b) {
    return a.error != b.error ? a.error < b.error : a.cost < b.cost;
  });
  double least = std::numeric_limits<double>::infinity();
  std::erase_if(states, [&](const State& state) {
    if (state.cost >= least) return true;
    least = state.cost;
    return false;
  });
}

}  // namespace

std::optional<std::vector<int>> cheapestMixture(const MixtureProblem& problem) {
  const std::size_t methods = problem.fixed.size();
  const std::size_t reflectors = problem.error.size();
  std::optional<std::vector<int>> best;
  double leastCost = std::numeric_limits<double>::infinity();
  for (std::size_t set = 1; set < (std::size_t{1} << methods); ++set) {
    double fixed = 0.0;
    for (std::size_t m = 0; m < methods; ++m)
      if ((set >> m & 1) != 0) fixed += problem.fixed[m];
    std::vector<std::vector<State>> layers{{State{0.0, fixed, -1, 0}}};
    for (std::size_t r = 0; r < reflectors; ++r) {
      std::vector<State> next;
      for (std::size_t s = 0; s < layers[r].size(); ++s)
        for (std::size_t m = 0; m < methods; ++m) {
          const State state{layers[r][s].error + problem.error[r][m],
                            layers[r][s].cost + problem.cost[r][m], static_cast<int>(m), s};
          if ((set >> m & 1) != 0 && state.error <= problem.mostError && state.cost < leastCost)
            next.push_back(state);
        }
      prune(next);
      layers.push_back(std::move(next));
    }
    if (layers.back().empty()) continue;
    // The last one has the largest error that is allowed, and the least cost.
    std::size_t at = layers.back().size() - 1;
    leastCost = layers.back()[at].cost;
    std::vector<int> choice(reflectors);
    for (std::size_t r = reflectors; r-- > 0;) {
      choice[r] = layers[r + 1][at].method;
      at = layers[r + 1][at].before;
    }
    best = choice;
  }
  return best;
}

}  // namespace catoptric::study
