// Reflections along a line, by their places on it.
#include "methods/perturbation/reflection_match.h"

#include <gtest/gtest.h>

#include <initializer_list>

namespace catoptric::methods::perturbation {
namespace {

constexpr std::size_t kNo = kMaxReflections;

Reflections reflectionsAt(std::initializer_list<double> places) {
  Reflections reflections;
  for (const double x : places) reflections.at[reflections.count++].x = {x, 0.0, 0.0};
  return reflections;
}

TEST(ReflectionMatch, NearestAndHalfway) {
  const Reflections middle = reflectionsAt({0.1, 4.0, 9.0});
  EXPECT_EQ(nearestTo(middle, {2.0, 0.0, 0.0}), 0u);
  EXPECT_EQ(nearestTo(middle, {2.1, 0.0, 0.0}), 1u);
  EXPECT_EQ(nearestTo({}, {}), kNo);
  // Near one end there is another reflection than half the way from end to end.
  const Reflections ends = reflectionsAt({0.0, 9.0});
  EXPECT_EQ(nearestBetween(middle, ends.at[0], ends.at[1]), 1u);
  EXPECT_EQ(nearestBetween(middle, ends.at[1], ends.at[0]), 1u);
  EXPECT_EQ(nearestBetween(middle, ends.at[0], ends.at[0]), 0u);
}

TEST(ReflectionMatch, CounterpartsAreTheNearestOfEachOther) {
  const Reflections a = reflectionsAt({0.0, 5.0, 6.0});
  const Reflections b = reflectionsAt({5.9, 0.2, 20.0});
  EXPECT_EQ(counterpart(a, 0, b), 1u);
  EXPECT_EQ(counterpart(a, 1, b), kNo);  // what is nearest to it is nearer to another
  EXPECT_EQ(counterpart(a, 2, b), 0u);
  EXPECT_EQ(counterpart(b, 2, a), kNo);
  const Counterparts all = counterparts(a, b);
  for (std::size_t i = 0; i < a.count; ++i) EXPECT_EQ(all[i], counterpart(a, i, b)) << i;
  // One at each end is the same, however far apart.
  EXPECT_EQ(counterpart(reflectionsAt({0.0}), 0, reflectionsAt({100.0})), 0u);
}

TEST(ReflectionMatch, OrderedPairsContinueEachOther) {
  EXPECT_TRUE(inOrder(reflectionsAt({0.0, 5.0}), reflectionsAt({0.5, 5.5})));
  EXPECT_FALSE(inOrder(reflectionsAt({0.0, 5.0}), reflectionsAt({5.5, 0.5})));
  EXPECT_FALSE(inOrder(reflectionsAt({0.0}), reflectionsAt({0.0, 5.0})));
  EXPECT_FALSE(inOrder({}, {}));
  EXPECT_FALSE(inOrder(reflectionsAt({0.0, 1.0, 2.0}), reflectionsAt({0.0, 1.0, 2.0})));
  EXPECT_EQ(counterparts(reflectionsAt({0.0, 5.0}), reflectionsAt({0.5, 5.5}))[1], 1u);
}

TEST(ReflectionMatch, AnEndLacksWhatTheOtherHas) {
  EXPECT_FALSE(lacks(reflectionsAt({0.0}), reflectionsAt({100.0})));
  EXPECT_TRUE(lacks(reflectionsAt({0.0}), reflectionsAt({0.0, 5.0})));
  EXPECT_FALSE(lacks(reflectionsAt({0.0, 5.0}), reflectionsAt({0.0})));
  EXPECT_TRUE(lacks({}, reflectionsAt({0.0})));
}

TEST(ReflectionMatch, MiddlesAreSoughtBetweenTheEndsAndAtWhatOneEndHas) {
  const Reflections guess = between(reflectionsAt({0.0, 50.0, 7.0}), reflectionsAt({8.0, 2.0}));
  ASSERT_EQ(guess.count, 3u);
  EXPECT_EQ(guess.at[0].x.x, 7.5);
  EXPECT_EQ(guess.at[1].x.x, 1.0);
  EXPECT_EQ(guess.at[2].x.x, 50.0);
}

}  // namespace
}  // namespace catoptric::methods::perturbation
