#include "config/options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>

#include "config/pages.h"
#include "core/error.h"

namespace catoptric::config {
namespace {

enum class Policy { Static, Refit };
constexpr auto kPolicies = names<Policy>({{"static", Policy::Static}, {"refit", Policy::Refit}});
constexpr auto kSources = names<bool>({{"scene", false}, {"environment", true}});

struct Inner {
  float error = 0.1f;
};
struct Options {
  int rays = 8;
  Policy bvh = Policy::Refit;
  bool environmentOnly = true;
  bool compound = true;
  float density = 10.0f;
  double reach = 0.75;
  std::uint64_t seed = 1;
  std::string frames = "1-3";
  std::vector<std::string> layers;
  Inner inner;
  std::optional<Vec3> centre;
  int width = 512;
};

const OptionTable<Options>& imageTable() {
  static const OptionTable<Options> table(
      "image", "Size.", {field(&Options::width, "width", range(1, 16384), "pixels")});
  return table;
}

const OptionTable<Options>& table() {
  static const OptionTable<Options> table(
      "fake", "Options of a fake.",
      {field(&Options::rays, "rays", range(1, 64), "rays per sample"),
       field(&Options::bvh, "bvh", kPolicies, "policy"),
       field(&Options::environmentOnly, "source", kSources, "what is seen"),
       field(&Options::compound, "compound", "one draw"),
       field(&Options::density, "density", atLeast(0.01), "factor"),
       field(&Options::reach, "reach", "metres"),
       field(&Options::seed, "seed", "seed"),
       field(&Options::frames, "frames", "frames"),
       field(&Options::layers, "layers", AllowedItems{{"Z", "N"}}, "layers"),
       field(in(&Options::inner, &Inner::error), "error", range(0, 1), "pixels"),
       {{.name = "center", .help = "place", .defaultText = "\"scene\""},
        [](Options& options, const Value& value) {
          if (value.kind() != Value::Kind::String) options.centre = value.asVec3();
        }},
       group("image", imageTable(), "size")});
  return table;
}

TEST(Options, WhatIsAbsentHasTheStructsDefault) {
  const Options options = table().parse(parseText("{}", "f"));
  EXPECT_EQ(options.rays, 8);
  EXPECT_EQ(options.bvh, Policy::Refit);
  EXPECT_TRUE(options.environmentOnly);
  EXPECT_TRUE(options.compound);
  EXPECT_EQ(options.density, 10.0f);
  EXPECT_EQ(options.reach, 0.75);
  EXPECT_EQ(options.seed, 1u);
  EXPECT_EQ(options.frames, "1-3");
  EXPECT_TRUE(options.layers.empty());
  EXPECT_EQ(options.inner.error, 0.1f);
  EXPECT_FALSE(options.centre);
  EXPECT_EQ(options.width, 512);
}

TEST(Options, EveryKindOfMemberIsRead) {
  const Options options = table().parse(parseText(
      R"({"rays": 64, "bvh": "static", "source": "scene", "compound": false, "density": 0.3,
          "reach": 0.1, "seed": 9007199254740993, "frames": "7", "layers": ["N", "Z"],
          "error": 0.2, "center": [1, 2, 3], "image": {"width": 3}})",
      "f"));
  EXPECT_EQ(options.rays, 64);
  EXPECT_EQ(options.bvh, Policy::Static);
  EXPECT_FALSE(options.environmentOnly);
  EXPECT_FALSE(options.compound);
  EXPECT_EQ(options.density, 0.3f);
  EXPECT_EQ(options.reach, 0.1);
  EXPECT_EQ(options.seed, 9007199254740993u);  // exact, where a double is not
  EXPECT_EQ(options.frames, "7");
  EXPECT_THAT(options.layers, testing::ElementsAre("N", "Z"));
  EXPECT_EQ(options.inner.error, 0.2f);
  EXPECT_EQ(options.centre.value(), Vec3(1, 2, 3));
  EXPECT_EQ(options.width, 3);
}

TEST(Options, AllFaultsAtOnceWithPlaces) {
  try {
    table().parse(parseText(
        "{\"rays\": 65,\n\"bvh\": \"refitt\",\n\"layers\": [\"X\"],\n\"image\": {\"width\": 0},\n"
        "\"dens\": 1}",
        "f"));
    FAIL();
  } catch (const UsageError& error) {
    EXPECT_STREQ(
        error.what(),
        "f:1: /rays: 65 is out of range; allowed: 1 to 64\n"
        "f:2: /bvh: \"refitt\" is not allowed (did you mean \"refit\"?); allowed: static, "
        "refit\n"
        "f:3: /layers/0: \"X\" is not allowed (did you mean \"Z\"?); allowed: Z, N\n"
        "f:4: /image/width: 0 is out of range; allowed: 1 to 16384\n"
        "f:5: /dens: unknown name \"dens\"; allowed: rays, bvh, source, compound, density, "
        "reach, seed, frames, layers, error, center, image");
  }
}

TEST(Options, NumbersFitIntoFloats) {
  EXPECT_EQ(table().parse(parseText(R"({"density": 3.4e38})", "f")).density, 3.4e38f);
  for (const char* name : {"density", "reach"}) {
    try {
      table().parse(parseText("{\"" + std::string(name) + "\": 1e39}", "f"));
      FAIL();
    } catch (const UsageError& error) {
      EXPECT_EQ(error.what(),
                "f:1: /" + std::string(name) + ": 1e+39 is too large (the limit is 3.4e38)");
    }
  }
}

TEST(Options, TheSchemaShowsDefaultsRangesAndNames) {
  const std::string text = markdownList(table().schema());
  for (const char* line :
       {"- `rays` (`8`; 1 to 64): rays per sample\n", "- `bvh` (`\"refit\"`; static): policy\n",
        "- `source` (`\"environment\"`; scene): what is seen\n",
        "- `compound` (`true`): one draw\n", "- `density` (`10`; at least 0.01): factor\n",
        "- `reach` (`0.75`): metres\n", "- `frames` (`\"1-3\"`): frames\n",
        "- `layers` (`[]`; Z, N): layers\n",
        "- `error` (`0.1`; 0 to 1): pixels\n",  // a float, in its own digits
        "- `center` (`\"scene\"`): place\n", "- `image` (object: image): size\n",
        "- `width` (`512`; 1 to 16384): pixels\n"})
    EXPECT_THAT(text, testing::HasSubstr(line));
}

TEST(Options, NamesGoBothWays) {
  EXPECT_STREQ(kPolicies.of(Policy::Refit), "refit");
  EXPECT_EQ(kPolicies.value("static"), Policy::Static);
}

}  // namespace
}  // namespace catoptric::config
