// A formula in x, y and z as a flat list of operations, each on results of earlier ones. evaluate.h
// evaluates it on any kind of number. parseFormula() makes it from text.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace catoptric::implicit {

enum class Code : std::uint8_t {
  Constant,
  X,
  Y,
  Z,
  // operations on two results
  Add,
  Subtract,
  Multiply,
  Divide,
  Min,
  Max,
  // operations on one result
  Negate,
  Square,
  IntegerPower,  ///< a ^ constant
  RealPower,     ///< a ^ constant, a >= 0
  AbsPower,      ///< |a| ^ constant
  Sqrt,
  Sin,
  Cos,
  Atan,
  Exp,
  Log,
  Abs,
};

struct Operation {
  Code code = Code::Constant;
  std::uint16_t a = 0;  ///< indices of earlier operations
  std::uint16_t b = 0;
  double constant = 0.0;
  bool operator==(const Operation&) const = default;
};

/// The result of the last operation is the value of the formula. Never empty.
using Tape = std::vector<Operation>;

inline constexpr std::size_t kMaxFormulaLength = 10'000;  ///< characters
inline constexpr std::size_t kMaxOperations = 1'000;
inline constexpr int kMaxNesting = 100;  ///< of parentheses, signs and powers

/// A name for a number in a formula.
using Parameter = std::pair<std::string, double>;

/// Parses a formula. It may contain + - * / ^, parentheses, numbers, x, y, z, pi, `parameters`, and
/// the functions sqrt sin cos tan atan exp log abs min max pow hypot. ^ is right-associative and
/// binds more tightly than the sign: -x^2 is -(x^2). `what` names the formula's place in messages.
/// Throws SceneError with the column and a caret below it, also if the formula contains none of x,
/// y and z.
Tape parseFormula(std::string_view text, const std::vector<Parameter>& parameters = {},
                  std::string_view what = "formula");

}  // namespace catoptric::implicit
