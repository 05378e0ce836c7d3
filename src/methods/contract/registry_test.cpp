#include <gtest/gtest.h>

#include <set>

#include "methods/contract/method.h"

namespace catoptric::methods {
namespace {

TEST(Registry, EntriesAreCompleteAndDistinct) {
  std::set<std::string> ids;
  for (const MethodEntry& entry : registry()) {
    EXPECT_TRUE(ids.insert(entry.id).second) << entry.id;
    EXPECT_FALSE(entry.summary.empty()) << entry.id;
    EXPECT_EQ(entry.summary.find('\n'), std::string::npos) << entry.id;
    EXPECT_FALSE(entry.steps.empty()) << entry.id;
    ASSERT_NE(entry.make, nullptr) << entry.id;
  }
  EXPECT_FALSE(ids.empty());
}

TEST(Registry, DefaultsMakeEveryMethod) {
  for (const MethodEntry& entry : registry()) {
    const config::Value options = config::parseText("{}", "defaults of " + entry.id);
    EXPECT_TRUE(config::check(options, entry.options).empty()) << entry.id;
    EXPECT_NE(entry.make(options), nullptr) << entry.id;
  }
}

}  // namespace
}  // namespace catoptric::methods
