#include "study/axes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"

namespace catoptric::study {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

std::vector<std::string> valuesOf(const std::string& text) {
  std::vector<std::string> values;
  for (const auto& value : parseAxis(text).values) values.push_back(value.front());
  return values;
}

std::string messageOf(const std::function<void()>& body) {
  try {
    body();
  } catch (const UsageError& error) {
    return error.what();
  }
  return "nothing was thrown";
}

TEST(Axes, ListsAndRanges) {
  EXPECT_THAT(valuesOf("a=1,2,3"), ElementsAre("1", "2", "3"));
  EXPECT_THAT(valuesOf("a=0..1:5"), ElementsAre("0", "0.25", "0.5", "0.75", "1"));
  EXPECT_THAT(valuesOf("a=log:0.1..10:3"), ElementsAre("0.1", "1", "10"));
  EXPECT_THAT(valuesOf("a=[1,2],[3,4]"), ElementsAre("[1,2]", "[3,4]"));
  EXPECT_THAT(valuesOf("path=../a.json,../b.json"), ElementsAre("../a.json", "../b.json"));
  EXPECT_EQ(parseAxis("methods.traced.rays=1,2").method, "traced");
}

TEST(Axes, WhatIsWrongIsSaid) {
  EXPECT_THAT(messageOf([] { parseAxis("rays"); }), HasSubstr("must be NAME=VALUES"));
  EXPECT_THAT(messageOf([] { parseAxis("a=1,,2"); }), HasSubstr("a value is empty"));
  EXPECT_THAT(messageOf([] { parseAxis("a=1,1"); }), HasSubstr("twice"));
  EXPECT_THAT(messageOf([] { parseAxis("a=5..1:3"); }),
              HasSubstr("must run from a smaller to a larger number"));
  EXPECT_THAT(messageOf([] { parseAxis("a=1..5"); }), HasSubstr("has no count"));
  EXPECT_THAT(messageOf([] { parseAxis("a=log:0..5:3"); }), HasSubstr("above 0"));
  EXPECT_THAT(messageOf([] { parseAxis("a=0..5:1"); }), HasSubstr("from 2 to"));
}

TEST(Axes, PointsAreAllCombinationsThatConcernAMethod) {
  const std::vector<Axis> axes{parseAxis("methods.a.x=1,2"), parseAxis("image.width=8,16"),
                               parseAxis("methods.a.y=5,6")};
  const std::vector<Point> points = makePoints({"a", "b"}, axes, {});
  ASSERT_EQ(points.size(), 10u);  // 2 widths x (4 of a, 1 of b)
  EXPECT_EQ(points[0].group, "width=8");
  EXPECT_EQ(settingsText(points[0].settings), "width=8 x=1 y=5");
  EXPECT_EQ(points[4].method, "b");
  EXPECT_EQ(settingsText(points[4].settings), "width=8");
  EXPECT_EQ(points[5].group, "width=16");
}

TEST(Axes, LinkedOptionsChangeTogether) {
  std::vector<Axis> axes{parseAxis("image.width=8,16"), parseAxis("image.height=6,12")};
  linkAxes(axes, "image.width,image.height");
  const std::vector<Point> points = makePoints({"a"}, axes, {});
  ASSERT_EQ(points.size(), 2u);
  EXPECT_EQ(settingsText(points[1].settings), "width=16 height=12");
  // Of two methods: both have both
  std::vector<Axis> ofTwo{parseAxis("methods.a.x=1,2"), parseAxis("methods.b.y=3,4")};
  linkAxes(ofTwo, "methods.a.x,methods.b.y");
  const std::vector<Point> both = makePoints({"a", "b"}, ofTwo, {});
  ASSERT_EQ(both.size(), 4u);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(both[i].method, i % 2 == 0 ? "a" : "b");
    EXPECT_EQ(settingsText(both[i].settings), i < 2 ? "x=1 y=3" : "x=2 y=4");
  }
  std::vector<Axis> uneven{parseAxis("a=1,2"), parseAxis("b=1")};
  EXPECT_THAT(messageOf([&] { linkAxes(uneven, "a,b"); }), HasSubstr("a has 2 values, b has 1"));
  EXPECT_THAT(messageOf([&] { linkAxes(uneven, "a,c"); }), HasSubstr("no --vary is called \"c\""));
}

TEST(Axes, ConditionsChoose) {
  const std::vector<Axis> axes{parseAxis("methods.a.low=1,2,3"), parseAxis("methods.a.high=1,2,3")};
  const Condition condition("low<high && high!=2", axes);
  const std::vector<Point> points = makePoints({"a"}, axes, {condition});
  ASSERT_EQ(points.size(), 2u);
  EXPECT_EQ(settingsText(points[0].settings), "low=1 high=3");
  EXPECT_THAT(messageOf([&] { Condition("lwo<2", axes); }), HasSubstr("no --vary"));
  EXPECT_THAT(messageOf([&] { Condition("low is 2", axes); }), HasSubstr("is not a comparison"));
  EXPECT_THAT(messageOf([&] { makePoints({"a"}, axes, {Condition("low>5", axes)}); }),
              HasSubstr("no combination"));
}

TEST(Axes, OptionsThatTradeGiveAxes) {
  config::Schema schema{.name = "m", .help = "", .fields = {}};
  schema.fields.push_back({.name = "rays", .trade = "2,8"});
  schema.fields.push_back({.name = "seed"});
  schema.fields.push_back({.name = "order", .trade = "near,far"});
  const std::vector<Axis> axes = automaticAxes(
      "fast", schema, config::parseText(R"({"rays": 4, "seed": 1, "order": "far"})", "options"));
  ASSERT_EQ(axes.size(), 2u);
  EXPECT_EQ(axes[0].names, std::vector<std::string>{"methods.fast.rays"});
  EXPECT_EQ(axes[0].values, (std::vector<std::vector<std::string>>{{"2"}, {"4"}, {"8"}}));
  EXPECT_EQ(axes[1].values, (std::vector<std::vector<std::string>>{{"near"}, {"far"}}));
  EXPECT_EQ(axes[1].method, "fast");
}

TEST(Axes, AnAxisOfNoMethodIsAnError) {
  EXPECT_THAT(messageOf([] { makePoints({"traced"}, {parseAxis("methods.trased.rays=1")}, {}); }),
              HasSubstr("did you mean \"traced\"?"));
}

}  // namespace
}  // namespace catoptric::study
