#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <numbers>
#include <optional>

#include "core/error.h"
#include "core/text.h"
#include "scene/implicit/evaluate.h"

namespace catoptric::implicit {
namespace {

using Term = std::uint16_t;  ///< the number of an operation

struct Function {
  std::string_view name;
  std::size_t least, most;  ///< arguments
};
constexpr std::array kFunctions{
    Function{"sqrt", 1, 1}, Function{"sin", 1, 1}, Function{"cos", 1, 1}, Function{"tan", 1, 1},
    Function{"atan", 1, 1}, Function{"exp", 1, 1}, Function{"log", 1, 1}, Function{"abs", 1, 1},
    Function{"min", 2, 8},  Function{"max", 2, 8}, Function{"pow", 2, 2}, Function{"hypot", 2, 3},
};

/// Exponents above are computed as real powers.
constexpr double kLargestIntegerExponent = 32.0;

class Parser {
 public:
  Parser(std::string_view text, const std::vector<Parameter>& parameters, std::string_view what)
      : text_(text), parameters_(parameters), what_(what) {}

  Tape parse() {
    if (text_.size() > kMaxFormulaLength) {
      throw SceneError(std::string(what_) + ": " + std::to_string(text_.size()) +
                       " characters; at most " + std::to_string(kMaxFormulaLength) +
                       " are allowed");
    }
    const Term result = sum();
    skipSpace();
    if (at_ < text_.size()) fail(at_, "expected an operator or the end, found " + found());
    if (tape_[result].code == Code::Constant) {
      fail(0, "does not depend on x, y or z: it is " + std::to_string(tape_[result].constant) +
                  " everywhere, which is not a surface");
    }
    return withoutUnused(result);
  }

 private:
  [[noreturn]] void fail(std::size_t at, const std::string& message) const {
    // An excerpt of one line around the place, and a caret below it.
    constexpr std::size_t kBefore = 40;
    constexpr std::size_t kExcerpt = 72;
    const std::size_t begin = at > kBefore ? at - kBefore : 0;
    std::string excerpt(text_.substr(begin, kExcerpt));
    for (char& c : excerpt) {
      if (static_cast<unsigned char>(c) < 0x20) c = ' ';
    }
    throw SceneError(std::string(what_) + ", column " + std::to_string(at + 1) + ": " + message +
                     "\n  " + (begin > 0 ? "..." : "") + excerpt + "\n  " +
                     std::string(at - begin + (begin > 0 ? 3 : 0), ' ') + "^");
  }
  std::string found() const {
    if (at_ >= text_.size()) return "the end";
    // A whole character of UTF-8: its first byte and those of the form 10xxxxxx after it
    std::size_t end = at_ + 1;
    while (end < text_.size() && (static_cast<unsigned char>(text_[end]) & 0xC0u) == 0x80u) ++end;
    return "'" + std::string(text_.substr(at_, end - at_)) + "'";
  }
  void skipSpace() {
    while (at_ < text_.size() &&
           (text_[at_] == ' ' || text_[at_] == '\t' || text_[at_] == '\n' || text_[at_] == '\r'))
      ++at_;
  }
  bool take(char c) {
    skipSpace();
    if (at_ >= text_.size() || text_[at_] != c) return false;
    ++at_;
    return true;
  }

  // ---- Operations, with constants folded and equal ones shared ----
  Term push(const Operation& op) {
    const auto same = std::find(tape_.begin(), tape_.end(), op);
    if (same != tape_.end()) return static_cast<Term>(same - tape_.begin());
    if (tape_.size() == kMaxOperations)
      fail(at_, "more than " + std::to_string(kMaxOperations) + " operations");
    tape_.push_back(op);
    return static_cast<Term>(tape_.size() - 1);
  }
  Term constant(double v, std::size_t at) {
    if (!std::isfinite(v)) fail(at, "a number that is not finite");
    return push({.code = Code::Constant, .constant = v});
  }
  std::optional<double> known(Term t) const {
    if (tape_[t].code != Code::Constant) return std::nullopt;
    return tape_[t].constant;
  }
  Term unary(Code code, Term a, double c = 0.0) {
    if (const auto v = known(a)) {
      const double folded = code == Code::Negate ? -*v : Arithmetic<double>::apply(code, *v, c);
      return constant(folded, at_ > 0 ? at_ - 1 : 0);
    }
    return push({.code = code, .a = a, .constant = c});
  }
  Term binary(Code code, Term a, Term b) {
    if (code == Code::Multiply && a == b) return unary(Code::Square, a);
    const auto u = known(a);
    const auto v = known(b);
    if (!u || !v) return push({.code = code, .a = a, .b = b});
    const std::size_t at = at_ > 0 ? at_ - 1 : 0;
    switch (code) {
      case Code::Add:
        return constant(*u + *v, at);
      case Code::Subtract:
        return constant(*u - *v, at);
      case Code::Multiply:
        return constant(*u * *v, at);
      case Code::Divide:
        return constant(*u / *v, at);
      case Code::Min:
        return constant(std::min(*u, *v), at);
      default:
        return constant(std::max(*u, *v), at);
    }
  }
  Term power(Term base, Term exponent) {
    const auto e = known(exponent);
    // u^v = exp(v log u)
    if (!e) return unary(Code::Exp, binary(Code::Multiply, exponent, unary(Code::Log, base)));
    if (*e == 0.0) return constant(1.0, at_);
    if (*e == 1.0) return base;
    if (*e == 2.0) return unary(Code::Square, base);
    const bool integer = *e == std::floor(*e) && std::abs(*e) <= kLargestIntegerExponent;
    if (integer) return unary(Code::IntegerPower, base, *e);
    if (tape_[base].code == Code::Abs) return unary(Code::AbsPower, tape_[base].a, *e);
    return unary(Code::RealPower, base, *e);
  }

  // ---- Grammar ----
  Term sum() {
    Term left = product();
    for (;;) {
      if (take('+')) {
        left = binary(Code::Add, left, product());
      } else if (take('-')) {
        left = binary(Code::Subtract, left, product());
      } else {
        return left;
      }
    }
  }
  Term product() {
    Term left = factor();
    for (;;) {
      if (take('*')) {
        left = binary(Code::Multiply, left, factor());
      } else if (take('/')) {
        left = binary(Code::Divide, left, factor());
      } else {
        return left;
      }
    }
  }
  Term factor() {
    skipSpace();
    if (++depth_ > kMaxNesting)
      fail(at_, "nested deeper than " + std::to_string(kMaxNesting) + " levels");
    Term result = 0;
    if (take('-')) {
      result = unary(Code::Negate, factor());
    } else if (take('+')) {
      result = factor();
    } else {
      result = primary();
      if (take('^')) result = power(result, factor());
    }
    --depth_;
    return result;
  }
  Term primary() {
    skipSpace();
    const std::size_t begin = at_;
    if (take('(')) {
      const Term inner = sum();
      if (!take(')'))
        fail(at_, "expected ')' for the '(' of column " + std::to_string(begin + 1) + ", found " +
                      found());
      return inner;
    }
    if (at_ >= text_.size()) fail(at_, "expected a number, a name or '(', found the end");
    const char c = text_[at_];
    if ((c >= '0' && c <= '9') || c == '.') return number();
    if (isLetter(c)) return name();
    fail(at_, "expected a number, a name or '(', found " + found());
  }
  Term number() {
    const std::size_t begin = at_;
    double v = 0.0;
    const auto [end, error] = std::from_chars(text_.data() + at_, text_.data() + text_.size(), v);
    if (error == std::errc::result_out_of_range) fail(begin, "a number that is too large or small");
    if (error != std::errc()) fail(begin, "not a number");
    at_ = static_cast<std::size_t>(end - text_.data());
    return constant(v, begin);
  }
  static bool isLetter(char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
  }
  Term name() {
    const std::size_t begin = at_;
    while (at_ < text_.size() && (isLetter(text_[at_]) || (text_[at_] >= '0' && text_[at_] <= '9')))
      ++at_;
    const std::string_view word = text_.substr(begin, at_ - begin);
    for (const auto& [parameter, value] : parameters_) {
      if (word == parameter) return constant(value, begin);
    }
    if (word == "x") return push({.code = Code::X});
    if (word == "y") return push({.code = Code::Y});
    if (word == "z") return push({.code = Code::Z});
    if (word == "pi") return constant(std::numbers::pi, begin);
    for (const Function& f : kFunctions) {
      if (word == f.name) return call(f, begin);
    }
    std::vector<std::string> names{"x", "y", "z", "pi"};
    for (const Function& f : kFunctions) names.emplace_back(f.name);
    for (const Parameter& p : parameters_) names.push_back(p.first);
    fail(begin, "unknown name \"" + std::string(word) + "\"" + didYouMean(word, names) +
                    "; known are " + joined(names, ", "));
  }
  Term call(const Function& f, std::size_t begin) {
    const std::string called(f.name);
    if (!take('(')) fail(at_, "expected '(' after " + called + ", found " + found());
    std::vector<Term> arguments;
    do {
      arguments.push_back(sum());
    } while (take(','));
    if (!take(')')) fail(at_, "expected ')' or ',' in " + called + "(), found " + found());
    if (arguments.size() < f.least || arguments.size() > f.most) {
      fail(begin, called + "() takes " + std::to_string(f.least) +
                      (f.most > f.least ? " to " + std::to_string(f.most) : "") +
                      (f.most > 1 ? " arguments, not " : " argument, not ") +
                      std::to_string(arguments.size()));
    }
    const Term a = arguments[0];
    if (f.name == "sqrt") return unary(Code::Sqrt, a);
    if (f.name == "sin") return unary(Code::Sin, a);
    if (f.name == "cos") return unary(Code::Cos, a);
    if (f.name == "tan") return binary(Code::Divide, unary(Code::Sin, a), unary(Code::Cos, a));
    if (f.name == "atan") return unary(Code::Atan, a);
    if (f.name == "exp") return unary(Code::Exp, a);
    if (f.name == "log") return unary(Code::Log, a);
    if (f.name == "abs") return unary(Code::Abs, a);
    if (f.name == "pow") return power(a, arguments[1]);
    if (f.name == "hypot") {
      Term squares = unary(Code::Square, a);
      for (std::size_t i = 1; i < arguments.size(); ++i)
        squares = binary(Code::Add, squares, unary(Code::Square, arguments[i]));
      return unary(Code::Sqrt, squares);
    }
    Term best = a;
    for (std::size_t i = 1; i < arguments.size(); ++i)
      best = binary(f.name == "min" ? Code::Min : Code::Max, best, arguments[i]);
    return best;
  }

  /// Only what `result` needs, which comes last.
  Tape withoutUnused(Term result) const {
    std::vector<bool> used(tape_.size(), false);
    used[result] = true;
    for (std::size_t i = result + std::size_t{1}; i-- > 0;) {
      if (!used[i] || tape_[i].code <= Code::Z) continue;
      used[tape_[i].a] = true;
      if (tape_[i].code <= Code::Max) used[tape_[i].b] = true;
    }
    std::vector<Term> moved(tape_.size(), 0);
    Tape kept;
    for (std::size_t i = 0; i <= result; ++i) {
      if (!used[i]) continue;
      moved[i] = static_cast<Term>(kept.size());
      Operation op = tape_[i];
      op.a = moved[op.a];
      op.b = moved[op.b];
      kept.push_back(op);
    }
    return kept;
  }

  std::string_view text_;
  const std::vector<Parameter>& parameters_;
  std::string_view what_;
  std::size_t at_ = 0;
  int depth_ = 0;
  Tape tape_;
};

}  // namespace

Tape parseFormula(std::string_view text, const std::vector<Parameter>& parameters,
                  std::string_view what) {
  return Parser(text, parameters, what).parse();
}

}  // namespace catoptric::implicit
