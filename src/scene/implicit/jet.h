// Jets: a value with all its partial derivatives with respect to x, y and z up to order 3.
// Arithmetic on jets applies the product and chain rules (forward mode), so the derivatives are
// exact up to rounding. Symmetric derivatives are stored once: 1 + 3 + 6 + 10 = 20 coefficients.
// The scalar may be any type that has the functions of <cmath> (double, a multiprecision number).
#pragma once

#include <array>
#include <cstddef>

namespace catoptric::implicit {

/// Index of the derivative with respect to x_i and x_j among a jet's coefficients.
inline constexpr std::array<std::array<std::size_t, 3>, 3> kHessianIndex{
    {{4, 5, 6}, {5, 7, 8}, {6, 8, 9}}};
/// Index of the derivative with respect to x_i, x_j and x_k.
inline constexpr std::array<std::array<std::array<std::size_t, 3>, 3>, 3> kThirdIndex{
    {{{{10, 11, 12}, {11, 13, 14}, {12, 14, 15}}},
     {{{11, 13, 14}, {13, 16, 17}, {14, 17, 18}}},
     {{{12, 14, 15}, {14, 17, 18}, {15, 18, 19}}}}};

template <class S>
struct Jet3 {
  /// value; x, y, z; xx, xy, xz, yy, yz, zz; xxx, xxy, xxz, xyy, xyz, xzz, yyy, yyz, yzz, zzz
  std::array<S, 20> c{};

  Jet3() = default;
  explicit Jet3(const S& value) { c[0] = value; }

  const S& value() const { return c[0]; }
  const S& gradient(std::size_t i) const { return c[1 + i]; }
  const S& hessian(std::size_t i, std::size_t j) const { return c[kHessianIndex[i][j]]; }
  const S& third(std::size_t i, std::size_t j, std::size_t k) const {
    return c[kThirdIndex[i][j][k]];
  }
};

/// A value and its derivative along a line.
template <class S>
struct Dual {
  S value{};
  S derivative{};
};

/// f(u) and its first three derivatives with respect to u.
template <class S>
struct Chain {
  S f0{}, f1{}, f2{}, f3{};
};

// ---- Jet3 ----
template <class S>
Jet3<S> operator+(Jet3<S> a, const Jet3<S>& b) {
  for (std::size_t i = 0; i < 20; ++i) a.c[i] += b.c[i];
  return a;
}
template <class S>
Jet3<S> operator-(Jet3<S> a, const Jet3<S>& b) {
  for (std::size_t i = 0; i < 20; ++i) a.c[i] -= b.c[i];
  return a;
}
template <class S>
Jet3<S> operator-(Jet3<S> a) {
  for (S& v : a.c) v = -v;
  return a;
}
template <class S>
Jet3<S> operator*(const Jet3<S>& a, const Jet3<S>& b) {
  Jet3<S> r;
  r.c[0] = a.c[0] * b.c[0];
  for (std::size_t i = 0; i < 3; ++i) {
    const S& ai = a.gradient(i);
    const S& bi = b.gradient(i);
    r.c[1 + i] = a.c[0] * bi + ai * b.c[0];
    for (std::size_t j = i; j < 3; ++j) {
      const S& aj = a.gradient(j);
      const S& bj = b.gradient(j);
      r.c[kHessianIndex[i][j]] =
          a.c[0] * b.hessian(i, j) + ai * bj + aj * bi + a.hessian(i, j) * b.c[0];
      for (std::size_t k = j; k < 3; ++k) {
        r.c[kThirdIndex[i][j][k]] = a.c[0] * b.third(i, j, k) + ai * b.hessian(j, k) +
                                    aj * b.hessian(i, k) + a.gradient(k) * b.hessian(i, j) +
                                    a.hessian(i, j) * b.gradient(k) + a.hessian(i, k) * bj +
                                    a.hessian(j, k) * bi + a.third(i, j, k) * b.c[0];
      }
    }
  }
  return r;
}
/// f(u), by the chain rule.
template <class S>
Jet3<S> composed(const Chain<S>& f, const Jet3<S>& u) {
  Jet3<S> r;
  r.c[0] = f.f0;
  for (std::size_t i = 0; i < 3; ++i) {
    const S& ui = u.gradient(i);
    r.c[1 + i] = f.f1 * ui;
    for (std::size_t j = i; j < 3; ++j) {
      const S& uj = u.gradient(j);
      const S uiuj = ui * uj;
      r.c[kHessianIndex[i][j]] = f.f1 * u.hessian(i, j) + f.f2 * uiuj;
      for (std::size_t k = j; k < 3; ++k) {
        const S& uk = u.gradient(k);
        r.c[kThirdIndex[i][j][k]] =
            f.f1 * u.third(i, j, k) +
            f.f2 * (u.hessian(i, j) * uk + u.hessian(i, k) * uj + u.hessian(j, k) * ui) +
            f.f3 * (uiuj * uk);
      }
    }
  }
  return r;
}

// ---- Dual ----
template <class S>
Dual<S> operator+(const Dual<S>& a, const Dual<S>& b) {
  return {a.value + b.value, a.derivative + b.derivative};
}
template <class S>
Dual<S> operator-(const Dual<S>& a, const Dual<S>& b) {
  return {a.value - b.value, a.derivative - b.derivative};
}
template <class S>
Dual<S> operator-(const Dual<S>& a) {
  return {-a.value, -a.derivative};
}
template <class S>
Dual<S> operator*(const Dual<S>& a, const Dual<S>& b) {
  return {a.value * b.value, a.value * b.derivative + a.derivative * b.value};
}
template <class S>
Dual<S> composed(const Chain<S>& f, const Dual<S>& u) {
  return {f.f0, f.f1 * u.derivative};
}

}  // namespace catoptric::implicit
