// Formulas: what they mean, what is refused and how, and that intervals enclose.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "core/error.h"
#include "scene/implicit/evaluate.h"

namespace catoptric::implicit {
namespace {

using testing::HasSubstr;

double evaluated(const std::string& text, double x, double y, double z) {
  return Evaluator<double>(parseFormula(text, {{"a", 0.75}}))(x, y, z);
}

std::string refusal(const std::string& text) {
  try {
    parseFormula(text);
  } catch (const SceneError& e) {
    return e.what();
  }
  return "accepted";
}

TEST(Formula, HasTheUsualPrecedence) {
  const double x = 0.7;
  const double y = -1.3;
  const double z = 2.1;
  EXPECT_DOUBLE_EQ(evaluated("x + y * z", x, y, z), x + y * z);
  EXPECT_DOUBLE_EQ(evaluated("(x + y) * z", x, y, z), (x + y) * z);
  EXPECT_DOUBLE_EQ(evaluated("x - y - z", x, y, z), x - y - z);
  EXPECT_DOUBLE_EQ(evaluated("x / y / z", x, y, z), x / y / z);
  EXPECT_DOUBLE_EQ(evaluated("-x^2", x, y, z), -(x * x));
  EXPECT_DOUBLE_EQ(evaluated("x^-2", x, y, z), 1 / (x * x));
  EXPECT_DOUBLE_EQ(evaluated("z^x^2", x, y, z), std::pow(z, x * x));
  EXPECT_DOUBLE_EQ(evaluated("2^3^2 + 0*x", x, y, z), 512);
  EXPECT_DOUBLE_EQ(evaluated("- -x + +y", x, y, z), x + y);
  EXPECT_DOUBLE_EQ(evaluated("1.5e1*x - .5*a", x, y, z), 15 * x - 0.375);
  EXPECT_DOUBLE_EQ(evaluated("y^3", x, y, z), y * y * y);
  EXPECT_DOUBLE_EQ(evaluated("abs(y)^2.5", x, y, z), std::pow(-y, 2.5));
}

TEST(Formula, KnowsItsFunctions) {
  const double x = 0.7;
  const double y = -1.3;
  const double z = 2.1;
  EXPECT_DOUBLE_EQ(evaluated("sqrt(x) + sin(y) * cos(z)", x, y, z),
                   std::sqrt(x) + std::sin(y) * std::cos(z));
  EXPECT_DOUBLE_EQ(evaluated("tan(y)", x, y, z), std::tan(y));
  EXPECT_DOUBLE_EQ(evaluated("atan(y) + exp(x) - log(z)", x, y, z),
                   std::atan(y) + std::exp(x) - std::log(z));
  EXPECT_DOUBLE_EQ(evaluated("min(x, y, z) + 2*max(x, y) + abs(y)", x, y, z), y + 2 * x - y);
  EXPECT_DOUBLE_EQ(evaluated("hypot(x, y, z) - hypot(x, 3)", x, y, z),
                   std::hypot(x, y, z) - std::hypot(x, 3.0));
  EXPECT_DOUBLE_EQ(evaluated("pow(z, 1/3) + pi*x", x, y, z),
                   std::pow(z, 1.0 / 3.0) + std::numbers::pi * x);
}

TEST(Formula, SharesEqualPartsAndFoldsConstants) {
  // x, x^2, y, y^2, sum, root, constant, difference
  EXPECT_EQ(parseFormula("sqrt(x^2 + y^2) - (1 + 2*3)").size(), 8u);
  EXPECT_EQ(parseFormula("(x + y)*(x + y)").size(), 4u);
  EXPECT_EQ(parseFormula("x^3").size(), 2u);
}

TEST(Formula, RefusalsSayWhereAndWhat) {
  EXPECT_EQ(
      refusal("x + sqr(y)"),
      "formula, column 5: unknown name \"sqr\" (did you mean \"sqrt\"?); known are x, y, z, pi, "
      "sqrt, sin, cos, tan, atan, exp, log, abs, min, max, pow, hypot\n  x + sqr(y)\n      ^");
  EXPECT_EQ(refusal("(x + y"),
            "formula, column 7: expected ')' for the '(' of column 1, found the end\n  (x + y\n"
            "        ^");
  EXPECT_THAT(refusal(""), HasSubstr("column 1: expected a number, a name or '(', found the end"));
  EXPECT_THAT(refusal("x +"), HasSubstr("column 4: expected a number"));
  EXPECT_THAT(refusal("x y"), HasSubstr("column 3: expected an operator or the end, found 'y'"));
  EXPECT_THAT(refusal("x \u00d7 y"), HasSubstr("found '\u00d7'"));
  EXPECT_THAT(refusal("x)"), HasSubstr("column 2: expected an operator or the end, found ')'"));
  EXPECT_THAT(refusal("x * * y"), HasSubstr("column 5: expected a number"));
  EXPECT_THAT(refusal("min(x)"), HasSubstr("column 1: min() takes 2 to 8 arguments, not 1"));
  EXPECT_THAT(refusal("sin(x, y)"), HasSubstr("column 1: sin() takes 1 argument, not 2"));
  EXPECT_THAT(refusal("sin x"), HasSubstr("column 5: expected '(' after sin, found 'x'"));
  EXPECT_THAT(refusal("x - 1e999"), HasSubstr("column 5: a number that is too large or small"));
  EXPECT_THAT(refusal("x - 1/0"), HasSubstr("a number that is not finite"));
  EXPECT_THAT(refusal("x - sqrt(-1)"), HasSubstr("a number that is not finite"));
  EXPECT_THAT(refusal("1 + 2"), HasSubstr("does not depend on x, y or z: it is 3.0"));
  EXPECT_THAT(refusal("x + \x01"), HasSubstr("column 5"));
  EXPECT_THAT(refusal("x \xff"), HasSubstr("column 3"));
}

TEST(Formula, LimitsLengthDepthAndOperations) {
  EXPECT_THAT(refusal(std::string(200, '(') + "x" + std::string(200, ')')),
              HasSubstr("nested deeper than 100 levels"));
  EXPECT_THAT(refusal(std::string(5000, '-') + "x"), HasSubstr("nested deeper than 100"));
  EXPECT_THAT(refusal(std::string(20'000, ' ')), HasSubstr("at most 10000"));
  std::string sum = "x";
  for (int i = 0; i < 1200; ++i) sum += "+" + std::to_string(i + 2);
  EXPECT_THAT(refusal(sum), HasSubstr("more than 1000 operations"));
  // An excerpt of a long formula is a line.
  const std::string message = refusal("x + " + std::string(500, '1') + "/0*q + " + sum);
  EXPECT_LT(message.size(), 500u);
}

TEST(Formula, AnyTextIsReadOrRefused) {
  const std::vector<std::string> words{
      "x",    "y",    "z",    "(",  ")",     "+",     "-",    "*",    "/",    "^",
      ",",    "1.5",  "2",    "0",  "1e300", "sqrt(", "sin(", "min(", "pow(", "hypot(",
      "abs(", "log(", "exp(", "pi", " ",     "q",     "\xc3", ".",    "e5"};
  const std::vector<std::string> operands{"x", "y", "(z)", "2", "sin(x)", "abs(y)", "0.5"};
  const std::vector<std::string> operators{"+", "-", "*", "/", "^"};
  std::mt19937 random(12);
  int read = 0;
  for (int i = 0; i < 30'000; ++i) {
    std::string text;
    // Mostly operands and operators in turn.
    for (std::size_t k = random() % 12; k-- > 0;) {
      text += random() % 6 == 0 ? words[random() % words.size()]
              : k % 2 == 0      ? operands[random() % operands.size()]
                                : operators[random() % operators.size()];
    }
    try {
      const Tape tape = parseFormula(text);
      ++read;
      // Whatever the values are, an interval holds what doubles give.
      const double v = Evaluator<double>(tape)(0.3, -1.2, 2.0);
      const Interval range = Evaluator<Interval>(tape)({0.3, 0.3}, {-1.2, -1.2}, {2.0, 2.0});
      if (std::isfinite(v)) {
        ASSERT_TRUE(range.lo <= v && v <= range.hi) << text;
      }
      Evaluator<Jet3<double>> jets(tape);
      Jet3<double> x(0.3);
      x.c[1] = 1.0;
      const double byJet = jets(x, Jet3<double>(-1.2), Jet3<double>(2.0)).value();
      if (std::isfinite(v) && std::isfinite(byJet)) {
        ASSERT_NEAR(byJet, v, 1e-9 * std::abs(v) + 1e-300) << text;
      }
    } catch (const SceneError& e) {
      ASSERT_NE(std::string(e.what()).find("column"), std::string::npos);
    }
  }
  EXPECT_GT(read, 1000);
}

TEST(Formula, IntervalsEncloseWhatDoublesGive) {
  const std::vector<std::string> formulas{"x*y - z",
                                          "x/y",
                                          "x^2 - y^3 + z^-2",
                                          "sqrt(x) - y",
                                          "sin(x) + cos(3*y)*sin(z*9)",
                                          "tan(x)",
                                          "atan(x) * exp(y)",
                                          "log(x)",
                                          "min(x, y, z) - max(x, 2*y)",
                                          "abs(x)^1.3 + abs(y)^0.4",
                                          "pow(x, 2.7)",
                                          "x^y",
                                          "abs(x - y)",
                                          "hypot(x, y) - z",
                                          "(x-1)^5",
                                          "sqrt(x^2+z^2)-(y^3-y)"};
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(-3.0, 3.0);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  int looked = 0;
  for (const std::string& text : formulas) {
    const Tape tape = parseFormula(text);
    Evaluator<Interval> bounds(tape);
    Evaluator<Dual<Interval>> slopes(tape);
    Evaluator<double> value(tape);
    Evaluator<Dual<double>> slope(tape);
    for (int box = 0; box < 400; ++box) {
      std::array<Interval, 3> v;
      // Points, narrow and wide boxes.
      const double width = box % 3 == 0 ? 0.0 : std::pow(10.0, -6.0 * unit(random));
      for (Interval& i : v) {
        i.lo = uniform(random);
        i.hi = i.lo + width;
      }
      const Interval g = bounds(v[0], v[1], v[2]);
      const Dual<Interval> d = slopes({v[0], {1, 1}}, {v[1], {-0.5, -0.5}}, {v[2], {2, 2}});
      for (int sample = 0; sample < 20; ++sample) {
        const auto inside = [&](const Interval& i) {
          return std::min(i.hi, i.lo + unit(random) * width);
        };
        const double x = inside(v[0]);
        const double y = inside(v[1]);
        const double z = inside(v[2]);
        const double at = value(x, y, z);
        if (std::isnan(at)) continue;
        ++looked;
        ASSERT_FALSE(g.undefined()) << text;
        ASSERT_LE(g.lo, at) << text;
        ASSERT_GE(g.hi, at) << text;
        const double by = slope({x, 1}, {y, -0.5}, {z, 2}).derivative;
        if (std::isnan(by)) continue;
        ASSERT_LE(d.derivative.lo, by) << text << " at " << x << " " << y << " " << z;
        ASSERT_GE(d.derivative.hi, by) << text << " at " << x << " " << y << " " << z;
      }
    }
  }
  EXPECT_GT(looked, 80'000);
}

TEST(Formula, IntervalsOfUndefinedFunctions) {
  const auto range = [](const std::string& text, Interval x) {
    return Evaluator<Interval>(parseFormula(text))(x, {0, 0}, {0, 0});
  };
  EXPECT_TRUE(range("sqrt(x)", {-2, -1}).undefined());
  EXPECT_TRUE(range("log(x) + 1", {-2, -1}).undefined());
  EXPECT_FALSE(range("sqrt(x)", {-2, 1}).undefined());
  EXPECT_FALSE(range("1/x", {-1, 1}).bounded());
  EXPECT_EQ(range("x^2", {-1, 2}).lo, 0.0);
  EXPECT_EQ(range("sin(x)", {1, 2}).hi, 1.0);
  EXPECT_LT(range("sin(x)", {2, 3}).hi, 0.91);
  // Tight on a point.
  EXPECT_LT(range("sin(x)*exp(x) - sqrt(x)", {2, 2}).width(), 4e-14);
}

}  // namespace
}  // namespace catoptric::implicit
