// Evaluates a tape (a formula as a list of operations) on scalars, intervals, or jets and duals of
// either.
#pragma once

#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <limits>
#include <new>
#include <type_traits>
#include <vector>

#include "scene/implicit/interval.h"
#include "scene/implicit/jet.h"
#include "scene/implicit/tape.h"

namespace catoptric::implicit {

template <class S>
S square(const S& v) {
  return v * v;
}
template <class S>
S integerPower(const S& v, int exponent) {
  if (exponent < 0) return S(1) / integerPower(v, -exponent);
  S p(1);
  for (int i = 0; i < exponent; ++i) p *= v;
  return p;
}
/// The derivative of |u|; NaN at u = 0.
template <class S>
S signOf(const S& v) {
  if (v > 0) return S(1);
  if (v < 0) return S(-1);
  return std::numeric_limits<S>::quiet_NaN();
}

template <class S>
S constantOf(double v) {
  if constexpr (std::is_same_v<S, Interval>) {
    return Interval{v, v};
  } else {
    return S(v);
  }
}
/// u^(exponent - order) for u >= 0; undefined if 0 is raised to a negative power.
template <class S>
S realPower(const S& u, double exponent, int order) {
  using std::pow;
  if constexpr (std::is_same_v<S, Interval>) {
    // The difference is exact for exponents from 0.5 on.
    if (exponent >= 0.5 || order == 0) return pow(u, exponent - order);
    return pow(u, exponent) / integerPower(u, order);
  } else {
    const S power = S(exponent) - S(order);
    if (power == 0) return S(1);
    if (u < 0 || (u == 0 && power < 0)) return std::numeric_limits<S>::quiet_NaN();
    return pow(u, power);
  }
}

// The values of u^n and its derivatives up to `Order` (0, 1 or 3).

template <int Order, class S>
Chain<S> integerPowerChain(const S& u, int n) {
  const auto number = [](double v) { return constantOf<S>(v); };
  const auto derivative = [&](int order, double factor) {
    return factor == 0.0 ? number(0) : number(factor) * integerPower(u, n - order);
  };
  Chain<S> f;
  f.f0 = integerPower(u, n);
  if constexpr (Order >= 1) f.f1 = derivative(1, n);
  if constexpr (Order >= 3) {
    f.f2 = derivative(2, static_cast<double>(n) * (n - 1));
    f.f3 = derivative(3, static_cast<double>(n) * (n - 1) * (n - 2));
  }
  return f;
}
template <int Order, class S>
Chain<S> realPowerChain(const S& u, double exponent) {
  const auto number = [](double v) { return constantOf<S>(v); };
  const S c = number(exponent);
  Chain<S> f;
  f.f0 = realPower(u, exponent, 0);
  if constexpr (Order >= 1) f.f1 = c * realPower(u, exponent, 1);
  if constexpr (Order >= 3) {
    f.f2 = c * (c - number(1)) * realPower(u, exponent, 2);
    f.f3 = c * (c - number(1)) * (c - number(2)) * realPower(u, exponent, 3);
  }
  return f;
}
/// The values of |u|^exponent and its derivatives. Odd derivatives have the sign of u; at 0 they
/// are 0 or undefined.
template <int Order, class S>
Chain<S> absPowerChain(const S& u, double exponent) {
  using std::abs;
  const auto number = [](double v) { return constantOf<S>(v); };
  const S c = number(exponent);
  const S size = S(abs(u));
  const auto signedPower = [&](int order) {
    if constexpr (!std::is_same_v<S, Interval>) {
      if (u == 0 && exponent > order) return S(0);
    }
    return realPower(size, exponent, order) * signOf(u);
  };
  Chain<S> f;
  f.f0 = realPower(size, exponent, 0);
  if constexpr (Order >= 1) f.f1 = c * signedPower(1);
  if constexpr (Order >= 3) {
    f.f2 = c * (c - number(1)) * realPower(size, exponent, 2);
    f.f3 = c * (c - number(1)) * (c - number(2)) * signedPower(3);
  }
  return f;
}
template <int Order, class S>
Chain<S> atanChain(const S& u) {
  using std::atan;
  const auto number = [](double v) { return constantOf<S>(v); };
  Chain<S> f;
  f.f0 = atan(u);
  if constexpr (Order >= 1) f.f1 = number(1) / (number(1) + square(u));
  if constexpr (Order >= 3) {
    f.f2 = number(-2) * u * square(f.f1);
    f.f3 = square(f.f1) * (number(8) * square(u) * f.f1 - number(2));
  }
  return f;
}
/// The values of the function `code` at u and its derivatives up to `Order` (0, 1 or 3).
template <int Order, class S>
Chain<S> chainOf(Code code, const S& u, double constant) {
  using std::abs;
  using std::cos;
  using std::exp;
  using std::log;
  using std::sin;
  using std::sqrt;
  const auto number = [](double v) { return constantOf<S>(v); };
  Chain<S> f;
  switch (code) {
    case Code::Square:
      f.f0 = square(u);
      if constexpr (Order >= 1) f.f1 = number(2) * u;
      if constexpr (Order >= 3) f.f2 = number(2);
      return f;
    case Code::IntegerPower:
      return integerPowerChain<Order>(u, static_cast<int>(constant));
    case Code::RealPower:
      return realPowerChain<Order>(u, constant);
    case Code::AbsPower:
      return absPowerChain<Order>(u, constant);
    case Code::Sqrt:
      f.f0 = sqrt(u);
      if constexpr (Order >= 1) f.f1 = number(0.5) / f.f0;
      if constexpr (Order >= 3) {
        f.f2 = number(-0.5) * f.f1 / u;
        f.f3 = number(-1.5) * f.f2 / u;
      }
      return f;
    case Code::Sin:
    case Code::Cos: {
      f.f0 = code == Code::Sin ? S(sin(u)) : S(cos(u));
      if constexpr (Order >= 1) f.f1 = code == Code::Sin ? S(cos(u)) : S(-sin(u));
      if constexpr (Order >= 3) {
        f.f2 = -f.f0;
        f.f3 = -f.f1;
      }
      return f;
    }
    case Code::Atan:
      return atanChain<Order>(u);
    case Code::Exp:
      f.f0 = exp(u);
      if constexpr (Order >= 1) f.f1 = f.f0;
      if constexpr (Order >= 3) f.f2 = f.f3 = f.f0;
      return f;
    case Code::Log:
      f.f0 = log(u);
      if constexpr (Order >= 1) f.f1 = number(1) / u;
      if constexpr (Order >= 3) {
        f.f2 = -square(f.f1);
        f.f3 = number(-2) * f.f1 * f.f2;
      }
      return f;
    case Code::Abs:
      f.f0 = abs(u);
      if constexpr (Order >= 1) f.f1 = signOf(u);
      return f;
    case Code::Divide: {  // 1 / u
      f.f0 = number(1) / u;
      if constexpr (Order >= 1) f.f1 = -square(f.f0);
      if constexpr (Order >= 3) {
        f.f2 = number(-2) * f.f0 * f.f1;
        f.f3 = number(-3) * f.f0 * f.f2;
      }
      return f;
    }
    default:
      assert(false);
      return f;
  }
}

/// The operations of each kind of number: constants, functions, quotients, and the minimum.
template <class S>
struct Arithmetic {
  static S constant(double v) { return constantOf<S>(v); }
  static S apply(Code code, const S& u, double c) { return chainOf<0>(code, u, c).f0; }
  static S quotient(const S& a, const S& b) { return a / b; }
  static S smaller(const S& a, const S& b) {
    if constexpr (std::is_same_v<S, Interval>) {
      if (a.undefined() || b.undefined()) return Interval::undefinedEverywhere();
      return {std::min(a.lo, b.lo), std::min(a.hi, b.hi)};
    } else {
      if (a < b) return a;
      return b <= a ? b : std::numeric_limits<S>::quiet_NaN();
    }
  }
};
template <class S>
struct Arithmetic<Jet3<S>> {
  static Jet3<S> constant(double v) { return Jet3<S>(S(v)); }
  static Jet3<S> apply(Code code, const Jet3<S>& u, double c) {
    return composed(chainOf<3>(code, u.value(), c), u);
  }
  static Jet3<S> quotient(const Jet3<S>& a, const Jet3<S>& b) {
    return a * apply(Code::Divide, b, 0.0);
  }
  static Jet3<S> smaller(const Jet3<S>& a, const Jet3<S>& b) {
    if (a.value() < b.value()) return a;
    if (b.value() < a.value()) return b;
    // A kink, unless both are equal.
    if (a.c == b.c) return a;
    Jet3<S> r;
    r.c.fill(std::numeric_limits<S>::quiet_NaN());
    r.c[0] = a.value();
    return r;
  }
};
template <class S>
struct Arithmetic<Dual<S>> {
  static Dual<S> constant(double v) { return {constantOf<S>(v), constantOf<S>(0.0)}; }
  static Dual<S> apply(Code code, const Dual<S>& u, double c) {
    return composed(chainOf<1>(code, u.value, c), u);
  }
  static Dual<S> quotient(const Dual<S>& a, const Dual<S>& b) {
    return a * apply(Code::Divide, b, 0.0);
  }
  static Dual<S> smaller(const Dual<S>& a, const Dual<S>& b) {
    if constexpr (std::is_same_v<S, Interval>) {
      if (a.value.hi < b.value.lo) return a;
      if (b.value.hi < a.value.lo) return b;
      return {Arithmetic<S>::smaller(a.value, b.value), hull(a.derivative, b.derivative)};
    } else {
      return a.value < b.value ? a : b;
    }
  }
};

/// Storage for some plain values. A small number is stored in place and not initialized.
template <class T>
class Results {
 public:
  explicit Results(std::size_t size) : many_(size > kInPlace ? size : 0) {}
  Results(const Results&) = delete;
  Results& operator=(const Results&) = delete;
  T& operator[](std::size_t i) {
    return many_.empty() ? *std::launder(reinterpret_cast<T*>(few_.data()) + i) : many_[i];
  }

 private:
  static constexpr std::size_t kInPlace = 24;
  alignas(T) std::array<std::byte, kInPlace * sizeof(T)> few_;
  std::vector<T> many_;
};

/// Keeps the storage of intermediate results between evaluations.
template <class T>
class Evaluator {
 public:
  explicit Evaluator(const Tape& tape) : tape_(&tape), results_(tape.size()) {}

  const T& operator()(const T& x, const T& y, const T& z) {
    using A = Arithmetic<T>;
    for (std::size_t i = 0; i < tape_->size(); ++i) {
      const Operation& op = (*tape_)[i];
      const T& a = results_[op.a];
      const T& b = results_[op.b];
      T& r = results_[i];
      switch (op.code) {
        case Code::Constant:
          r = A::constant(op.constant);
          break;
        case Code::X:
          r = x;
          break;
        case Code::Y:
          r = y;
          break;
        case Code::Z:
          r = z;
          break;
        case Code::Add:
          r = a + b;
          break;
        case Code::Subtract:
          r = a - b;
          break;
        case Code::Multiply:
          r = a * b;
          break;
        case Code::Divide:
          r = A::quotient(a, b);
          break;
        case Code::Min:
          r = A::smaller(a, b);
          break;
        case Code::Max:
          r = -A::smaller(-a, -b);
          break;
        case Code::Negate:
          r = -a;
          break;
        default:
          r = A::apply(op.code, a, op.constant);
          break;
      }
    }
    return results_[tape_->size() - 1];
  }

 private:
  const Tape* tape_;
  std::conditional_t<std::is_trivially_copyable_v<T>, Results<T>, std::vector<T>> results_;
};

}  // namespace catoptric::implicit
