#include "config/json.h"

#include <gtest/gtest.h>

#include <fstream>

#include "core/error.h"

namespace catoptric::config {
namespace {

std::string messageOf(const std::function<void()>& action) {
  try {
    action();
  } catch (const UsageError& error) {
    return error.what();
  }
  return "(no error)";
}

std::string parseMessage(const std::string& text) {
  return messageOf([&] { parseText(text, "f.json"); });
}

TEST(Json, ValuesKnowTheirLineAndPointer) {
  const Value root =
      parseText("{\n  \"a\": 1,\n  \"b\": [\n    true,\n    {\"c/d\": -2.5\n}\n]\n}\n", "f.json");
  EXPECT_EQ(root.place().text(), "f.json:1: /");
  EXPECT_EQ(root.get("a").place().text(), "f.json:2: /a");
  EXPECT_EQ(root.get("b").asArray()[0].place().text(), "f.json:4: /b/0");
  EXPECT_EQ(root.get("b").asArray()[1].get("c/d").place().text(), "f.json:5: /b/1/c~1d");
  EXPECT_EQ(root.get("b").asArray()[1].get("c/d").asNumber(), -2.5);
}

TEST(Json, NumbersAtTheEndOfTheFile) {
  EXPECT_EQ(parseText("\n\n7", "f").place().line, 3);
  EXPECT_EQ(parseText("[1\n,\n2\n]", "f").asArray()[1].place().line, 3);
  EXPECT_EQ(parseText("512.0", "f").asInteger(), 512);
  EXPECT_EQ(parseText("9223372036854775807", "f").asInteger(), 9223372036854775807);
}

TEST(Json, ZeroBytesHideNothing) {
  EXPECT_EQ(parseMessage(std::string("{\"a\": 1}\n\0 {\"b\": 2}", 19)),
            "f.json:2: byte 9 of the text is zero, which is not allowed in JSON");
  EXPECT_EQ(parseMessage("{\"a\":\n [\"x.png\\u0000.jpg\"]}"),
            "f.json:2: /a/0: the character \\u0000 is not allowed in a text");
  EXPECT_NE(parseMessage("{\"a\\u0000\": 1}").find("\\u0000 is not allowed"), std::string::npos);
}

TEST(Json, NumbersKnowTheirText) {
  const std::string text = "{\"a\": -0.5e+3, \"b\":[7,36.0 ,1e2]}";
  const Value root = parseText(text, "f");
  const auto textOf = [&](const Value& value) {
    const auto [begin, end] = value.textRange();
    return text.substr(begin, end - begin);
  };
  EXPECT_EQ(textOf(root.get("a")), "-0.5e+3");
  EXPECT_EQ(textOf(root.get("b").asArray()[0]), "7");
  EXPECT_EQ(textOf(root.get("b").asArray()[1]), "36.0");
  EXPECT_EQ(textOf(root.get("b").asArray()[2]), "1e2");
}

TEST(Json, MalformedTextNamesLineAndColumn) {
  EXPECT_EQ(parseMessage("{\n  \"a\": 1, // size\n}"),
            "f.json:2:11: comments are not allowed in JSON");
  EXPECT_EQ(parseMessage("{\"a\": NaN}"), "f.json:1:7: /a: NaN is not a number in JSON");
  EXPECT_EQ(parseMessage("{\"a\": [1, {\"b/c\": 2,\n\"d\": -1e999}]}"),
            "f.json:2:12: /a/1/d: number overflow parsing '-1e999'");
  EXPECT_EQ(parseMessage("[[], [1, -Infinity]]"),
            "f.json:1:11: /1/1: -Infinity is not a number in JSON");
  EXPECT_EQ(parseMessage("NaN"), "f.json:1:1: /: NaN is not a number in JSON");
  EXPECT_EQ(parseMessage("{\"a\": 1, NaN: 2}"), "f.json:1:10: NaN is not a number in JSON");
  EXPECT_EQ(parseMessage("[1, 2,\n]"), "f.json:2:1: a comma before ']' is not allowed in JSON");
  EXPECT_EQ(
      parseMessage("{\"a\": 1"),
      "f.json:1:8: syntax error while parsing object - unexpected end of input; expected '}'");
  EXPECT_NE(parseMessage("").find("f.json:1:1: "), std::string::npos);
  EXPECT_NE(parseMessage("{} {}").find("f.json:1:4: "), std::string::npos);
  EXPECT_NE(parseMessage("\"\xff\"").find("f.json:1:2: "), std::string::npos);
}

TEST(Json, DuplicateNamesAreErrors) {
  EXPECT_EQ(parseMessage("{\"x\": {\"a\": 1,\n \"a\": 2}}"),
            "f.json:2: /x/a: duplicate name \"a\"");
}

TEST(Json, DepthIsCapped) {
  const std::string deep(100'000, '[');
  EXPECT_NE(parseMessage(deep).find("nested deeper than the 64 levels allowed"), std::string::npos);
  EXPECT_EQ(parseMessage(std::string(64, '[') + std::string(64, ']')), "(no error)");
}

TEST(Json, WrongKindsNamePlaceValueAndWhatIsWanted) {
  const Value root = parseText("{\"a\": \"big\",\n\"v\": [1, 2, 1e300]}", "f.json");
  EXPECT_EQ(messageOf([&] { root.get("a").asNumber(); }), "f.json:1: /a: \"big\" is not a number");
  EXPECT_EQ(messageOf([&] { root.get("size").asInteger(); }),
            "f.json:1: /: \"size\" is missing; expected an integer");
  EXPECT_EQ(messageOf([&] { root.get("v").asVec3(); }),
            "f.json:2: /v/2: 1e+300 is too large (the limit is 3.4e38)");
  EXPECT_EQ(messageOf([&] { parseText("1.5", "f.json").asInteger(); }),
            "f.json:1: /: 1.5 is not an integer");
  EXPECT_EQ(messageOf([&] { root.get("a").get("b"); }), "f.json:1: /a: \"big\" is not an object");
  EXPECT_TRUE(root.get("absent").isNull());
}

TEST(Json, FilesThatCannotBeReadAreUsageErrors) {
  EXPECT_EQ(messageOf([] { parseFile("no/such.json"); }),
            "no/such.json: cannot be opened: No such file or directory");
}

TEST(Json, SettingsReplaceAndAdd) {
  Value root = parseText("{\"image\": {\"width\": 1}, \"methods\": [{\"bvh\": \"static\"}]}", "f");
  root = withSetting(root, "image.width", "64");
  root = withSetting(root, "image.samples", "3");
  root = withSetting(root, "methods.0.bvh", "refit");
  root = withSetting(root, "methods.1", "{\"method\": \"traced\"}");
  root = withSetting(root, "a.b", "[1, 2]");
  EXPECT_EQ(root.dump(),
            "{\"a\":{\"b\":[1,2]},\"image\":{\"samples\":3,\"width\":64},"
            "\"methods\":[{\"bvh\":\"refit\"},{\"method\":\"traced\"}]}");
  EXPECT_EQ(messageOf([&] { root.get("image").get("width").asString(); }),
            "--set image.width=64: /image/width: 64 is not a string");
  EXPECT_EQ(messageOf([&] { withSetting(root, "methods.7.x", "1"); }),
            "--set methods.7.x=1: /methods/7: \"7\" is not an index from 0 to 2 (the array at f:1: "
            "/methods has 2 members)");
  EXPECT_EQ(messageOf([&] { withSetting(root, "methods.0.bvh.x", "1"); }),
            "--set methods.0.bvh.x=1: /methods/0/bvh/x: \"refit\" at --set methods.0.bvh=refit: "
            "/methods/0/bvh has no members");
  EXPECT_NE(messageOf([&] { withSetting(root, "a..b", "1"); }).find("names joined by dots"),
            std::string::npos);
}

TEST(Json, WithoutKeepsPlaces) {
  const Value root = parseText("{\"a\": 1,\n\"b\": 2}", "f");
  EXPECT_EQ(without(root, {"a", "c"}).dump(), "{\"b\":2}");
  EXPECT_EQ(without(root, {"a"}).get("b").place().text(), "f:2: /b");
}

TEST(Json, DumpIsCanonical) {
  EXPECT_EQ(parseText("{\"b\": 1.0, \"a\": 0.1, \"c\": null}", "f").dump(),
            parseText("{\"c\": null,\n\"a\": 1e-1, \"b\": 1}", "g").dump());
}

}  // namespace
}  // namespace catoptric::config
