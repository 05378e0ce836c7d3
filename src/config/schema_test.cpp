#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "config/json.h"
#include "config/json_text.h"
#include "config/pages.h"
#include "core/error.h"

namespace catoptric::config {
namespace {

const Schema& inner() {
  static const Schema schema{
      "item",
      "One item.",
      {{.name = "bvh",
        .type = FieldType::String,
        .help = "Policy.",
        .defaultText = "\"static\"",
        .allowed = {"static", "refit"}},
       {.name = "color", .type = FieldType::Vec3, .help = "Colour.", .minimum = 0.0}}};
  return schema;
}

const Schema& outer() {
  static const Schema schema{
      "run",
      "A run.",
      {{.name = "scene", .type = FieldType::String, .help = "Scene file.", .required = true},
       {.name = "width",
        .type = FieldType::Integer,
        .help = "Pixels.",
        .defaultText = "512",
        .minimum = 1,
        .maximum = 16384},
       {.name = "items",
        .type = FieldType::Array,
        .help = "Items.",
        .minimum = 1,
        .object = &inner()},
       {.name = "layers",
        .type = FieldType::Array,
        .allowed = {"Z", "N"},
        .items = FieldType::String}}};
  return schema;
}

TEST(Schema, AllErrorsOfAFileAtOnce) {
  const Value value = parseText(
      "{\n\"widht\": 3,\n\"width\": 0,\n\"items\": [{\"bvh\": \"statik\"},\n{\"color\": [1, -1, "
      "\"x\"]}, 5],\n\"layers\": [\"Y\"]\n}",
      "f.json");
  EXPECT_THAT(
      check(value, outer()),
      testing::ElementsAre(
          "f.json:2: /widht: unknown name \"widht\" (did you mean \"width\"?); allowed: scene, "
          "width, items, layers",
          "f.json:3: /width: 0 is out of range; allowed: 1 to 16384",
          "f.json:4: /items/0/bvh: \"statik\" is not allowed (did you mean \"static\"?); allowed: "
          "static, refit",
          "f.json:5: /items/1/color/1: -1 is out of range; allowed: at least 0",
          "f.json:5: /items/1/color/2: \"x\" is not a number",
          "f.json:5: /items/2: 5 is not an object",
          "f.json:6: /layers/0: \"Y\" is not allowed (did you mean \"Z\"?); allowed: Z, N",
          "f.json:1: /: \"scene\" is missing; expected a string"));
}

TEST(Schema, KindsAndSizes) {
  const auto errorsOf = [](const std::string& text) {
    return check(parseText(text, "f"), outer());
  };
  EXPECT_THAT(
      errorsOf("{\"scene\": 5, \"width\": 1.5, \"items\": []}"),
      testing::ElementsAre("f:1: /scene: 5 is not a string", "f:1: /width: 1.5 is not an integer",
                           "f:1: /items: has 0 items; allowed: at least 1"));
  EXPECT_THAT(errorsOf("[]"), testing::ElementsAre("f:1: /: [] is not an object"));
  EXPECT_THAT(errorsOf("{\"scene\": \"a\", \"items\": [{\"color\": [1, 2]}]}"),
              testing::ElementsAre("f:1: /items/0/color: [1,2] is not an array of 3 numbers"));
  EXPECT_TRUE(errorsOf("{\"scene\": \"a\", \"width\": 16384, \"items\": [{}]}").empty());
  EXPECT_THROW(require(parseText("{}", "f"), outer()), UsageError);
}

TEST(Schema, DefaultsApplyWhereNothingStands) {
  const Value value = parseText("{\"scene\": \"a\"}", "f");
  EXPECT_EQ(valueOr(value, outer(), "width").asInteger(), 512);
  EXPECT_EQ(valueOr(value, outer(), "scene").asString(), "a");
  EXPECT_TRUE(valueOr(value, outer(), "items").isNull());
}

TEST(Schema, WithDefaultsIsComplete) {
  EXPECT_EQ(withDefaults(parseText("{\"scene\": \"a\", \"items\": [{}]}", "f"), outer()),
            "{\"items\":[{\"bvh\":\"static\"}],\"scene\":\"a\",\"width\":512}");
}

TEST(Schema, JsonSchemaHoldsTypesLimitsAndDefinitions) {
  const Value schema = parseText(jsonSchema(outer()), "schema");
  EXPECT_EQ(schema.get("$schema").asString(), "https://json-schema.org/draft/2020-12/schema");
  EXPECT_EQ(schema.get("required").dump(), "[\"scene\"]");
  EXPECT_EQ(schema.get("additionalProperties").asBool(), false);
  const Value properties = schema.get("properties");
  EXPECT_EQ(properties.get("width").dump(),
            "{\"default\":512,\"description\":\"Pixels.\",\"maximum\":16384,\"minimum\":1,"
            "\"type\":\"integer\"}");
  EXPECT_EQ(properties.get("items").get("items").dump(), "{\"$ref\":\"#/$defs/item\"}");
  EXPECT_EQ(schema.get("$defs").get("item").get("properties").get("color").dump(),
            "{\"description\":\"Colour.\",\"items\":{\"minimum\":0,\"type\":\"number\"},"
            "\"maxItems\":3,\"minItems\":3,"
            "\"type\":\"array\"}");
  EXPECT_EQ(schema.get("$defs").get("item").get("properties").get("bvh").get("enum").dump(),
            "[\"static\",\"refit\"]");
}

TEST(Schema, MarkdownListHasEveryField) {
  const std::string text = markdownList(outer());
  EXPECT_THAT(text, testing::HasSubstr("- `scene` (required): Scene file.\n"));
  EXPECT_THAT(text, testing::HasSubstr("- `width` (`512`; 1 to 16384): Pixels.\n"));
  EXPECT_THAT(text, testing::HasSubstr("- `items` (list of item; at least 1): Items.\n"));
  EXPECT_THAT(text, testing::HasSubstr("### item"));
}

TEST(JsonText, NumbersHaveTheDigitsOfTheirType) {
  EXPECT_EQ(numberText(0.2f), "0.2");
  EXPECT_EQ(numberText(0.2), "0.2");
  EXPECT_EQ(numberText(static_cast<double>(0.2f)), "0.20000000298023224");
  EXPECT_EQ(numberText(3.0f), "3.0");
  EXPECT_EQ(numberText(-1e-30f), "-1e-30");
  EXPECT_EQ(numberText(std::nanf("")), "null");
  EXPECT_EQ(JsonText().add("x", 0.1f).object(), "{\"x\":0.1}");
}

TEST(JsonText, NumbersAndStringsReadBackTheSame) {
  const std::string text = JsonText()
                               .add("quote", "a\"\\\n\x01")
                               .add("third", 1.0 / 3.0)
                               .add("big", std::uint64_t{18446744073709551615ull})
                               .add("nan", std::nan(""))
                               .add("yes", true)
                               .object();
  const Value value = parseText(text, "t");
  EXPECT_EQ(value.get("quote").asString(), "a\"\\\n\x01");
  EXPECT_EQ(value.get("third").asNumber(), 1.0 / 3.0);
  EXPECT_EQ(value.get("big").asNumber(), 18446744073709551615.0);
  EXPECT_TRUE(value.get("nan").isNull());
  EXPECT_TRUE(value.get("yes").asBool());
}

}  // namespace
}  // namespace catoptric::config
