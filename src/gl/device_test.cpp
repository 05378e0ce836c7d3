#include "gl/device.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "gl/shader.h"

namespace catoptric::gl {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Property;
using testing::Throws;

TEST(Device, ParsesEveryNameAndWritesItBack) {
  for (const char* name : {"auto", "egl:0", "egl:12", "surfaceless", "osmesa"}) {
    EXPECT_EQ(parseDevice(name).text(), name);
  }
  EXPECT_TRUE(parseDevice("auto").automatic);
  EXPECT_EQ(parseDevice("egl:12").index, 12);
}

TEST(Device, RefusesOtherNamesAndSaysWhatIsAllowed) {
  for (const char* name :
       {"", "egl", "egl:", "egl:-1", "egl:1x", "egl:99999999999", "Osmesa ", "cuda:0"}) {
    EXPECT_THAT(
        [&] { parseDevice(name); },
        Throws<UsageError>(Property(
            &UsageError::what, AllOf(HasSubstr("\"" + std::string(name) + "\""), HasSubstr("egl:N"),
                                     HasSubstr("surfaceless"), HasSubstr("osmesa")))))
        << name;
  }
  EXPECT_THAT(
      [] { parseDevice("osmeza"); },
      Throws<UsageError>(Property(&UsageError::what, HasSubstr("did you mean \"osmesa\""))));
}

TEST(Shader, LogsNameFileAndLineInEveryDriversForm) {
  const std::vector<std::string> files = {"a.frag", "b.glsl"};
  EXPECT_EQ(namedLog("1:12(5): error: oops", files), "b.glsl:12(5): error: oops");
  EXPECT_EQ(namedLog("0(7) : error C1503: oops", files), "a.frag:7 : error C1503: oops");
  EXPECT_EQ(namedLog("ERROR: 1:3: oops", files), "ERROR: b.glsl:3: oops");
  // A number beyond the files and lines of another form stay as they are.
  EXPECT_EQ(namedLog("2:12(5): error\nlinker says no", files), "2:12(5): error\nlinker says no");
}

}  // namespace
}  // namespace catoptric::gl
