#include "gl/workarounds.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <set>
#include <string>

#include "core/error.h"

namespace catoptric::gl {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Property;
using testing::Throws;

TEST(Workarounds, HaveANameAndAReasonEach) {
  std::set<std::string> names;
  for (const WorkaroundInfo& info : workarounds()) {
    EXPECT_EQ(&info - workarounds().data(), static_cast<std::ptrdiff_t>(info.workaround));
    EXPECT_TRUE(names.insert(info.name).second) << info.name;
    EXPECT_GT(std::string(info.reason).size(), 40u) << info.name;
    EXPECT_THAT(parseWorkarounds(info.name), ElementsAre(info.workaround));
  }
}

TEST(Workarounds, AreTurnedOffByTheirNames) {
  EXPECT_THAT(parseWorkarounds(""), IsEmpty());
  EXPECT_THAT(parseWorkarounds("mesa-one-clip-distance,software-flush-batches"),
              ElementsAre(Workaround::MesaOneClipDistance, Workaround::SoftwareFlushBatches));
  for (const char* odd : {"software-flush-batches,,mesa-one-clip-distance",
                          ",software-flush-batches,mesa-one-clip-distance,"})
    EXPECT_THAT(parseWorkarounds(odd),
                ElementsAre(Workaround::SoftwareFlushBatches, Workaround::MesaOneClipDistance));
  EXPECT_THAT([] { parseWorkarounds("mesa-one-clip-distanse"); },
              Throws<UsageError>(Property(&UsageError::what,
                                          HasSubstr("did you mean \"mesa-one-clip-distance\""))));
}

// In processes of their own, since the variable is read once.
TEST(WorkaroundsDeathTest, TheVariableTurnsThemOff) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(
      {
        setenv("CATOPTRIC_DISABLE_WORKAROUNDS", "software-flush-batches", 1);
        std::exit((worksAround(Workaround::SoftwareFlushBatches) ? 1 : 0) +
                  (worksAround(Workaround::MesaOneClipDistance) ? 0 : 2));
      },
      testing::ExitedWithCode(0), "");
  EXPECT_EXIT(
      {
        unsetenv("CATOPTRIC_DISABLE_WORKAROUNDS");
        std::exit(worksAround(Workaround::SoftwareFlushBatches) ? 0 : 1);
      },
      testing::ExitedWithCode(0), "");
}

}  // namespace
}  // namespace catoptric::gl
