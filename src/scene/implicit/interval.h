// Intervals of doubles, rounded outwards. The result of an operation contains every value that the
// operation can have for members of its operands, and also the rounded value that plain doubles
// give. A function that is undefined on part of an interval (the root of negative numbers) is
// bounded where it is defined. If it is undefined on all of the interval, the bounds are NaN
// (`undefined`).
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace catoptric::implicit {

struct Interval {
  double lo = 0.0;
  double hi = 0.0;

  static constexpr double kInfinity = std::numeric_limits<double>::infinity();
  static constexpr Interval entire() { return {-kInfinity, kInfinity}; }
  static constexpr Interval undefinedEverywhere() {
    return {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::quiet_NaN()};
  }
  bool undefined() const { return std::isnan(lo) || std::isnan(hi); }
  bool containsZero() const { return !(lo > 0.0) && !(hi < 0.0); }
  bool bounded() const { return std::isfinite(lo) && std::isfinite(hi); }
  double width() const { return hi - lo; }
};

namespace rounding {
/// A margin of at least `ulps` units in the last place. Exact zeros stay zero.
inline double margin(double v, double ulps) {
  return ulps * (std::abs(v) * 0x1p-52 + 0x1p-1074);
}
inline double below(double v, double ulps = 1.0) {
  return (v == 0.0 || std::isinf(v)) ? v : v - margin(v, ulps);
}
inline double above(double v, double ulps = 1.0) {
  return (v == 0.0 || std::isinf(v)) ? v : v + margin(v, ulps);
}
/// Replaces NaN bounds, which come from infinities, by infinities.
inline Interval checked(double lo, double hi) {
  if (std::isnan(lo)) lo = -Interval::kInfinity;
  if (std::isnan(hi)) hi = Interval::kInfinity;
  return {lo, hi};
}
/// Assumed error bound of the library's functions. (glibc's manual: at most 2 ulps for all of them)
inline constexpr double kFunctionUlps = 4.0;
inline Interval widened(double lo, double hi) {
  // A computed value may be exactly zero (log 1, sin 0) while the true values nearby are not
  return {below(lo, kFunctionUlps) - 0x1p-1000, above(hi, kFunctionUlps) + 0x1p-1000};
}
}  // namespace rounding

inline Interval operator-(const Interval& a) {
  return {-a.hi, -a.lo};
}
inline Interval operator+(const Interval& a, const Interval& b) {
  if (a.undefined() || b.undefined()) return Interval::undefinedEverywhere();
  return rounding::checked(rounding::below(a.lo + b.lo), rounding::above(a.hi + b.hi));
}
inline Interval operator-(const Interval& a, const Interval& b) {
  return a + (-b);
}
inline Interval operator*(const Interval& a, const Interval& b) {
  // Usually nothing is zero, infinite or undefined
  const double ll = a.lo * b.lo;
  const double lh = a.lo * b.hi;
  const double hl = a.hi * b.lo;
  const double hh = a.hi * b.hi;
  const auto plain = [](double p) {
    return std::abs(p) > 0.0 && std::abs(p) < Interval::kInfinity;
  };
  if (plain(ll) && plain(lh) && plain(hl) && plain(hh)) {
    return {rounding::below(std::min(std::min(ll, lh), std::min(hl, hh))),
            rounding::above(std::max(std::max(ll, lh), std::max(hl, hh)))};
  }
  if (a.undefined() || b.undefined()) return Interval::undefinedEverywhere();
  double lo = Interval::kInfinity;
  double hi = -Interval::kInfinity;
  for (const double x : {a.lo, a.hi}) {
    for (const double y : {b.lo, b.hi}) {
      const bool zero = x == 0.0 || y == 0.0;  // also zero times infinity
      const double p = zero ? 0.0 : x * y;
      const bool underflow = !zero && p == 0.0;
      lo = std::min(lo, underflow ? -0x1p-1074 : p);
      hi = std::max(hi, underflow ? 0x1p-1074 : p);
    }
  }
  return {rounding::below(lo), rounding::above(hi)};
}
inline Interval operator*(double s, const Interval& a) {
  return Interval{s, s} * a;
}
inline Interval operator/(const Interval& a, const Interval& b) {
  if (a.undefined() || b.undefined() || (b.lo == 0.0 && b.hi == 0.0))
    return Interval::undefinedEverywhere();
  if (b.containsZero()) return Interval::entire();
  return a * Interval{rounding::below(1.0 / b.hi), rounding::above(1.0 / b.lo)};
}
inline Interval hull(const Interval& a, const Interval& b) {
  if (a.undefined()) return b;
  if (b.undefined()) return a;
  return {std::min(a.lo, b.lo), std::max(a.hi, b.hi)};
}

inline Interval abs(const Interval& a) {
  if (a.undefined() || a.lo >= 0.0) return a;
  if (a.hi <= 0.0) return -a;
  return {0.0, std::max(-a.lo, a.hi)};
}
inline Interval square(const Interval& a) {
  const Interval m = abs(a);
  const Interval s = m * m;
  return {std::max(s.lo, 0.0), s.hi};
}
inline Interval sqrt(const Interval& a) {
  if (a.undefined() || a.hi < 0.0) return Interval::undefinedEverywhere();
  return {std::max(0.0, rounding::below(std::sqrt(std::max(a.lo, 0.0)))),
          rounding::above(std::sqrt(a.hi))};
}
inline Interval exp(const Interval& a) {
  if (a.undefined()) return a;
  const Interval r = rounding::widened(std::exp(a.lo), std::exp(a.hi));
  return {std::max(r.lo, 0.0), r.hi};
}
inline Interval log(const Interval& a) {
  if (a.undefined() || a.hi <= 0.0) return Interval::undefinedEverywhere();
  return rounding::widened(a.lo > 0.0 ? std::log(a.lo) : -Interval::kInfinity, std::log(a.hi));
}
inline Interval atan(const Interval& a) {
  if (a.undefined()) return a;
  return rounding::widened(std::atan(a.lo), std::atan(a.hi));
}
/// a^exponent with a real exponent. Defined for a > 0, and for a = 0 if the exponent is positive.
inline Interval pow(const Interval& a, double exponent) {
  if (a.undefined() || a.hi < 0.0) return Interval::undefinedEverywhere();
  // It is undefined on a part: a derivative could not rely on any bound
  if (a.lo < 0.0) return Interval::entire();
  const double p = std::pow(a.lo, exponent);
  const double q = std::pow(a.hi, exponent);
  const Interval r = rounding::widened(std::min(p, q), std::max(p, q));
  return {std::max(r.lo, 0.0), r.hi};
}
inline Interval integerPower(const Interval& a, int exponent) {
  if (a.undefined()) return a;
  if (exponent < 0) return Interval{1.0, 1.0} / integerPower(a, -exponent);
  if (exponent == 0) return {1.0, 1.0};
  const Interval base = exponent % 2 == 0 ? abs(a) : a;
  const auto power = [&](double v) {
    double p = 1.0;
    for (int i = 0; i < exponent; ++i) p *= v;
    return p;
  };
  // Each product adds half a unit
  const double ulps = static_cast<double>(exponent);
  const double lo = power(base.lo);
  const double hi = power(base.hi);
  const double tiny = 0x1p-1000;
  return {base.lo == 0.0 ? 0.0 : rounding::below(lo, ulps) - (std::abs(lo) < tiny ? tiny : 0.0),
          base.hi == 0.0 ? 0.0 : rounding::above(hi, ulps) + (std::abs(hi) < tiny ? tiny : 0.0)};
}
inline Interval cos(const Interval& a) {
  if (a.undefined()) return a;
  constexpr double kTurn = 2.0 * std::numbers::pi;
  // For larger arguments, multiples of the rounded pi are off by more than kSlack
  constexpr double kLargest = 1e6;
  constexpr double kSlack = 1e-8;
  if (!(a.lo > -kLargest && a.hi < kLargest && a.width() < kTurn)) return {-1.0, 1.0};
  const double first = std::cos(a.lo);
  const double last = std::cos(a.hi);
  const Interval ends = rounding::widened(std::min(first, last), std::max(first, last));
  const auto reaches = [&](double at) {
    const double next = at + kTurn * std::ceil((a.lo - kSlack - at) / kTurn);
    return next <= a.hi + kSlack;
  };
  return {reaches(std::numbers::pi) ? -1.0 : std::max(ends.lo, -1.0),
          reaches(0.0) ? 1.0 : std::min(ends.hi, 1.0)};
}
inline Interval sin(const Interval& a) {
  if (a.undefined()) return a;
  constexpr double kHalf = 0.5 * std::numbers::pi;
  const Interval shifted{rounding::below(a.lo - kHalf, 4.0) - 1e-16,
                         rounding::above(a.hi - kHalf, 4.0) + 1e-16};
  return cos(shifted);
}

/// Bounds of the derivative of |u|.
inline Interval signOf(const Interval& a) {
  if (a.undefined()) return a;
  return {a.lo > 0.0 ? 1.0 : -1.0, a.hi < 0.0 ? -1.0 : 1.0};
}

}  // namespace catoptric::implicit
