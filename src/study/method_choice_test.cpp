#include "study/method_choice.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>
#include <set>

namespace catoptric::study {
namespace {

double costOf(const MixtureProblem& problem, const std::vector<int>& choice) {
  double cost = 0.0;
  std::set<int> used(choice.begin(), choice.end());
  for (const int m : used) cost += problem.fixed[static_cast<std::size_t>(m)];
  for (std::size_t r = 0; r < choice.size(); ++r)
    cost += problem.cost[r][static_cast<std::size_t>(choice[r])];
  return cost;
}

double errorOf(const MixtureProblem& problem, const std::vector<int>& choice) {
  double error = 0.0;
  for (std::size_t r = 0; r < choice.size(); ++r)
    error += problem.error[r][static_cast<std::size_t>(choice[r])];
  return error;
}

/// The least cost of all 3^5 choices.
double bruteForce(const MixtureProblem& problem) {
  double best = std::numeric_limits<double>::infinity();
  for (int code = 0; code < 243; ++code) {
    std::vector<int> choice;
    for (int r = 0, rest = code; r < 5; ++r, rest /= 3) choice.push_back(rest % 3);
    if (errorOf(problem, choice) <= problem.mostError)
      best = std::min(best, costOf(problem, choice));
  }
  return best;
}

TEST(Mixture, IsTheBestOfAllChoices) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  int solved = 0;
  for (int trial = 0; trial < 300; ++trial) {
    MixtureProblem problem;
    for (int r = 0; r < 5; ++r) {
      problem.error.push_back({unit(random), unit(random), unit(random)});
      problem.cost.push_back({unit(random), unit(random), unit(random)});
    }
    problem.fixed = {unit(random), unit(random), unit(random)};
    problem.mostError = 0.5 + 2.0 * unit(random);
    const auto choice = cheapestMixture(problem);
    const double best = bruteForce(problem);
    ASSERT_EQ(choice.has_value(), best < std::numeric_limits<double>::infinity());
    if (!choice) continue;
    ++solved;
    EXPECT_LE(errorOf(problem, *choice), problem.mostError);
    EXPECT_NEAR(costOf(problem, *choice), best, 1e-12);
  }
  EXPECT_GT(solved, 100);
}

TEST(Mixture, AMethodThatCannotDoAReflectorIsNotChosen) {
  const double never = std::numeric_limits<double>::infinity();
  const auto choice =
      cheapestMixture({{{never, 1.0}, {0.0, 0.0}}, {{0.0, 5.0}, {0.0, 5.0}}, {0.0, 0.0}, 1.0});
  ASSERT_TRUE(choice);
  EXPECT_EQ(*choice, (std::vector<int>{1, 0}));
}

TEST(Mixture, WithoutAnAccurateChoiceThereIsNone) {
  EXPECT_FALSE(cheapestMixture({{{2.0}}, {{1.0}}, {0.0}, 1.0}));
}

}  // namespace
}  // namespace catoptric::study
