// How the reflection (or refraction) point x of one bounce moves with the point p before it: the
// Jacobian J and Hessian H, and the path's recursion from q back to p [Chen2000] (7), (10)-(14).
//
// Fermat: x makes |p - x| + V(x) stationary on the surface; V is the optical length of the rest of
// the path from x to q. Only V's derivatives at x are needed of the rest of the path; the paper's
// B J_{i+1} and its gradient contain them. The surface's unit normal n and a tangent frame e1, e2
// split the paper's 4 x 4 system: its last column and row only determine the multiplier lambda and
// the normal component. A symmetric 2 x 2 matrix remains to be inverted:
//   M(rho) = I - a a^T + rho K,   a = (e1 d, e2 d),   rho = |x - p|,   d = (x - p) / rho,
// where K is the tangent part of V'' + lambda g'' and does not depend on p's position on its ray.
// With y(u) = M^-1 (E^T u - a (d u)):
//   J u = E y(u),   H(u, v) = E y(u, v) - n b(y(u), y(v)),
//   M y(u, v) = (R0 + rho R1)(y(u), y(v)) + K (y(u) (d v) + y(v) (d u)),
// where b is the second fundamental form. K, R0, R1 and b (18 numbers, computed once) thus serve
// every p on the ray. Nothing here divides by rho: p may lie on the surface. Snell's law is the
// same condition with the indices of refraction as factors of the segments.
#pragma once

#include "methods/perturbation/vector.h"
#include "scene/implicit/jet.h"

namespace catoptric::methods::perturbation {

using implicit::Jet3;

enum class PathStatus {
  Regular,
  Caustic,    ///< M is singular up to rounding: p is on a focal line of the path
  Grazing,    ///< the segment touches the surface
  Degenerate  ///< no gradient, or consecutive points of the path coincide
};

/// Caustic: |det(1 + rho C)| is below this fraction of the sum of its terms (not from the paper).
inline constexpr double kCausticDeterminant = 1e-9;
/// Grazing: the cosine to the normal is below this (not from the paper).
inline constexpr double kGrazingCosine = 1e-7;

/// Optical length from a point to q along the rest of the path, at that point.
template <class S>
struct Eikonal {
  Vector<S> gradient;
  std::array<S, 6> hessian;  ///< xx, xy, xz, yy, yz, zz, as in Jet3
  std::array<S, 10> third;   ///< as in Jet3
};

template <class S>
struct Bounce {
  Vector<S> x, e1, e2, n;
  Vector<S> d;                 ///< unit, from p to x
  std::array<S, 2> a;          ///< (e1 d, e2 d)
  std::array<S, 3> k;          ///< components 11, 12, 22, as for b and omega
  std::array<S, 3> b;          ///< second fundamental form, about n
  std::array<S, 6> r0, r1;     ///< first component 11, 12, 22, then second component
  std::array<S, 3> omega;      ///< how d turns, for the rest of the recursion
  S cosine;                    ///< d n
  S index;                     ///< index of refraction between p and x
  std::array<S, 2> curvature;  ///< trace and determinant of C: det M = cosine^2 det(1 + rho C)
};

/// Index pairs in the order of Jet3's Hessian.
inline constexpr std::array<std::array<std::size_t, 2>, 6> kPairs{
    {{0, 0}, {0, 1}, {0, 2}, {1, 1}, {1, 2}, {2, 2}}};

template <class S>
S form(const std::array<S, 3>& f, const std::array<S, 2>& y, const std::array<S, 2>& z) {
  return f[0] * y[0] * z[0] + f[1] * (y[0] * z[1] + y[1] * z[0]) + f[2] * y[1] * z[1];
}

/// M^-1 of a bounce with p at distance rho: components 11, 12, 22.
template <class S>
std::array<S, 3> inverseMatrix(const Bounce<S>& bounce, const S& rho) {
  const S m11 = S(1) - bounce.a[0] * bounce.a[0] + rho * bounce.k[0];
  const S m12 = rho * bounce.k[1] - bounce.a[0] * bounce.a[1];
  const S m22 = S(1) - bounce.a[1] * bounce.a[1] + rho * bounce.k[2];
  const S r = S(1) / (m11 * m22 - m12 * m12);
  return {r * m22, -(r * m12), r * m11};
}
template <class S>
std::array<S, 2> times(const std::array<S, 3>& m, const std::array<S, 2>& y) {
  return {m[0] * y[0] + m[1] * y[1], m[1] * y[0] + m[2] * y[1]};
}
/// The tangent part of J u.
template <class S>
std::array<S, 2> tangentMotion(const Bounce<S>& bounce, const std::array<S, 3>& inverse,
                               const Vector<S>& u) {
  const S along = dot(bounce.d, u);
  return times(inverse,
               {dot(bounce.e1, u) - bounce.a[0] * along, dot(bounce.e2, u) - bounce.a[1] * along});
}
/// (R0 + rho R1)(y, z)
template <class S>
std::array<S, 2> quadraticTerm(const Bounce<S>& bounce, const S& rho, const std::array<S, 2>& y,
                               const std::array<S, 2>& z) {
  const S p = y[0] * z[0];
  const S q = y[0] * z[1] + y[1] * z[0];
  const S r = y[1] * z[1];
  const auto at = [&](std::size_t i) { return bounce.r0[i] + rho * bounce.r1[i]; };
  return {at(0) * p + at(1) * q + at(2) * r, at(3) * p + at(4) * q + at(5) * r};
}

/// The motion of x when p = x - rho d moves by a step: J step, and H(step, step) / 2.
template <class S>
struct Move {
  Vector<S> linear;
  Vector<S> second;
};
template <class S>
Move<S> moveOf(const Bounce<S>& bounce, const S& rho, const Vector<S>& step) {
  const std::array<S, 3> inverse = inverseMatrix(bounce, rho);
  const std::array<S, 2> y = tangentMotion(bounce, inverse, step);
  const S along = dot(bounce.d, step);
  const std::array<S, 2> ky = times(bounce.k, y);
  const std::array<S, 2> r = quadraticTerm(bounce, rho, y, y);
  const S half(0.5);
  const std::array<S, 2> second =
      times(inverse, {half * r[0] + along * ky[0], half * r[1] + along * ky[1]});
  const S normal = half * form(bounce.b, y, y);
  return {y[0] * bounce.e1 + y[1] * bounce.e2,
          second[0] * bounce.e1 + second[1] * bounce.e2 - normal * bounce.n};
}
/// Estimates the error of a quadratic move from the lengths of its two terms and of the step. The
/// next term is assumed to be smaller than the second by a factor that follows from the distance to
/// p and the surface's curvature (not from the paper; tested in path_test). The error of a linear
/// move is its second term.
inline double remainderOf(double linear, double second, double rho, double step) {
  constexpr double kTiny = 0x1p-500;
  return second * (step / (rho + kTiny) + 2.0 * second / (linear + kTiny));
}

/// Optical length of the straight segment from x to q.
template <class S>
Eikonal<S> straightTo(const Vector<S>& q, const Vector<S>& x, const S& index) {
  const S r = length(x - q);
  const Vector<S> w = (S(1) / r) * (x - q);
  Eikonal<S> v;
  v.gradient = index * w;
  const S bend = index / r;
  const S xx = S(1) - w[0] * w[0];
  const S yy = S(1) - w[1] * w[1];
  const S zz = S(1) - w[2] * w[2];
  const S xy = -(w[0] * w[1]);
  const S xz = -(w[0] * w[2]);
  const S yz = -(w[1] * w[2]);
  v.hessian = {bend * xx, bend * xy, bend * xz, bend * yy, bend * yz, bend * zz};
  const S turn = -(bend / r);
  const S two(2);
  const S three(3);
  v.third = {turn * three * xx * w[0],
             turn * (xx * w[1] + two * xy * w[0]),
             turn * (xx * w[2] + two * xz * w[0]),
             turn * (yy * w[0] + two * xy * w[1]),
             turn * three * xy * w[2],
             turn * (zz * w[0] + two * xz * w[2]),
             turn * three * yy * w[1],
             turn * (yy * w[2] + two * yz * w[1]),
             turn * (zz * w[1] + two * yz * w[2]),
             turn * three * zz * w[2]};
  return v;
}

/// Product of a symmetric matrix and a vector.
template <class S>
Vector<S> times(const std::array<S, 6>& m, const Vector<S>& v) {
  return {{m[0] * v[0] + m[1] * v[1] + m[2] * v[2], m[1] * v[0] + m[3] * v[1] + m[4] * v[2],
           m[2] * v[0] + m[4] * v[1] + m[5] * v[2]}};
}
/// Product of a symmetric tensor, in the order of Jet3's third derivatives, and a vector.
template <class S>
std::array<S, 6> times(const std::array<S, 10>& t, const Vector<S>& v) {
  return {t[0] * v[0] + t[1] * v[1] + t[2] * v[2], t[1] * v[0] + t[3] * v[1] + t[4] * v[2],
          t[2] * v[0] + t[4] * v[1] + t[5] * v[2], t[3] * v[0] + t[6] * v[1] + t[7] * v[2],
          t[4] * v[0] + t[7] * v[1] + t[8] * v[2], t[5] * v[0] + t[8] * v[1] + t[9] * v[2]};
}

/// The bounce of a path that comes from `before` at x on the surface with derivatives g.
template <class S>
Bounce<S> makeBounce(const Vector<S>& before, const Vector<S>& x, const Jet3<S>& g,
                     const Eikonal<S>& rest, const S& index) {
  using std::abs;
  Bounce<S> r;
  r.x = x;
  r.index = index;
  const Vector<S> gradient{{g.gradient(0), g.gradient(1), g.gradient(2)}};
  const S steepness = length(gradient);
  r.n = (S(1) / steepness) * gradient;
  // A frame about n, from the coordinate axis along which n is smallest.
  std::size_t axis = 0;
  for (std::size_t i = 1; i < 3; ++i) {
    if (abs(r.n[i]) < abs(r.n[axis])) axis = i;
  }
  Vector<S> unit;
  unit[axis] = S(1);
  r.e1 = normalized(cross(r.n, unit));
  r.e2 = cross(r.n, r.e1);
  r.d = normalized(x - before);
  r.cosine = dot(r.d, r.n);
  r.a = {dot(r.e1, r.d), dot(r.e2, r.d)};

  // The multiplier of g / |g'|, in units of the index: d + V' + lambda n = 0.
  const S lambda = -r.cosine - dot(r.n, rest.gradient) / index;
  // Second and third derivatives of the surface and of the function that is stationary at x
  const S perSteepness = S(1) / steepness;
  const S perIndex = S(1) / index;
  std::array<S, 6> surface2;
  std::array<S, 6> full2;
  for (std::size_t i = 0; i < 6; ++i) {
    surface2[i] = perSteepness * g.c[4 + i];
    full2[i] = perIndex * rest.hessian[i] + lambda * surface2[i];
  }
  std::array<S, 10> full3;
  for (std::size_t i = 0; i < 10; ++i)
    full3[i] = perIndex * rest.third[i] + lambda * (perSteepness * g.c[10 + i]);
  const Vector<S> b1 = times(surface2, r.e1);
  r.b = {dot(r.e1, b1), dot(r.e2, b1), dot(r.e2, times(surface2, r.e2))};
  const Vector<S> k1 = times(full2, r.e1);
  const Vector<S> k2 = times(full2, r.e2);
  r.k = {dot(r.e1, k1), dot(r.e2, k1), dot(r.e2, k2)};
  const std::array<S, 2> kn{dot(r.n, k1), dot(r.n, k2)};
  const std::array<S, 6> third1 = times(full3, r.e1);
  const Vector<S> third11 = times(third1, r.e1);
  const std::array<S, 4> third{dot(r.e1, third11), dot(r.e2, third11),
                               dot(r.e2, times(third1, r.e2)),
                               dot(r.e2, times(times(full3, r.e2), r.e2))};

  // d lambda = l y
  const std::array<S, 2> ka = times(r.k, r.a);
  const std::array<S, 2> l{-(ka[0] / r.cosine + kn[0]), -(ka[1] / r.cosine + kn[1])};
  // How d turns: (dd)^2 = y omega y, without a division by rho
  const S c2 = S(1) / (r.cosine * r.cosine);
  r.omega = {r.k[0] * r.k[0] + r.k[1] * r.k[1] + c2 * ka[0] * ka[0],
             r.k[0] * r.k[1] + r.k[1] * r.k[2] + c2 * ka[0] * ka[1],
             r.k[1] * r.k[1] + r.k[2] * r.k[2] + c2 * ka[1] * ka[1]};
  constexpr std::array<std::array<std::size_t, 2>, 3> kTangentPairs{{{0, 0}, {0, 1}, {1, 1}}};
  for (std::size_t c = 0; c < 2; ++c) {
    for (std::size_t pair = 0; pair < 3; ++pair) {
      const auto [i, j] = kTangentPairs[pair];
      r.r0[3 * c + pair] =
          -r.cosine * r.a[c] * r.b[pair] - (r.k[c + i] * r.a[j] + r.k[c + j] * r.a[i]);
      r.r1[3 * c + pair] = r.a[c] * r.omega[pair] - third[c + i + j] -
                           (l[j] * r.b[c + i] + l[i] * r.b[c + j]) + kn[c] * r.b[pair];
    }
  }
  // C = (I - a a^T)^-1 K, and (I - a a^T)^-1 = I + a a^T / cosine^2
  r.curvature = {r.k[0] + r.k[2] + c2 * (r.a[0] * ka[0] + r.a[1] * ka[1]),
                 c2 * (r.k[0] * r.k[2] - r.k[1] * r.k[1])};
  return r;
}

/// Whether a bounce with p at distance rho is usable.
template <class S>
PathStatus statusOf(const Bounce<S>& bounce, const S& rho) {
  using std::abs;
  if (!(abs(bounce.cosine) > S(kGrazingCosine))) return PathStatus::Grazing;
  const S linear = rho * bounce.curvature[0];
  const S squared = rho * rho * bounce.curvature[1];
  const S determinant = S(1) + linear + squared;
  if (!(abs(determinant) > S(kCausticDeterminant) * (S(1) + abs(linear) + abs(squared))))
    return PathStatus::Caustic;
  return PathStatus::Regular;
}

/// The optical length from the point before the bounce, at distance rho from x, to q.
template <class S>
Eikonal<S> before(const Bounce<S>& bounce, const S& rho) {
  const std::array<S, 3> inverse = inverseMatrix(bounce, rho);
  // The basis of the plane perpendicular to d that is dual to the frame.
  const Vector<S> f1 = bounce.e1 - S(bounce.a[0] / bounce.cosine) * bounce.n;
  const Vector<S> f2 = bounce.e2 - S(bounce.a[1] / bounce.cosine) * bounce.n;
  std::array<std::array<S, 2>, 3> y;
  std::array<std::array<S, 2>, 3> ky;
  for (std::size_t u = 0; u < 3; ++u) {
    y[u] = times(inverse, {bounce.e1[u] - bounce.a[0] * bounce.d[u],
                           bounce.e2[u] - bounce.a[1] * bounce.d[u]});
    ky[u] = times(bounce.k, y[u]);
  }
  Eikonal<S> v;
  v.gradient = S(-bounce.index) * bounce.d;
  for (std::size_t pair = 0; pair < 6; ++pair) {
    const auto [i, j] = kPairs[pair];
    v.hessian[pair] = bounce.index * (f1[j] * ky[i][0] + f2[j] * ky[i][1]);
    // y(u, v), and the condition's remaining second derivative across d and along it.
    const std::array<S, 2> r = quadraticTerm(bounce, rho, y[i], y[j]);
    const std::array<S, 2> second =
        times(inverse, {r[0] + ky[i][0] * bounce.d[j] + ky[j][0] * bounce.d[i],
                        r[1] + ky[i][1] * bounce.d[j] + ky[j][1] * bounce.d[i]});
    const std::array<S, 2> kSecond = times(bounce.k, second);
    const std::array<S, 3> c1{bounce.r1[0], bounce.r1[1], bounce.r1[2]};
    const std::array<S, 3> c2{bounce.r1[3], bounce.r1[4], bounce.r1[5]};
    const S z1 = form(c1, y[i], y[j]) - kSecond[0];
    const S z2 = form(c2, y[i], y[j]) - kSecond[1];
    const S turn = form(bounce.omega, y[i], y[j]);
    for (std::size_t k = j; k < 3; ++k) {
      v.third[implicit::kThirdIndex[i][j][k] - 10] =
          -bounce.index * (f1[k] * z1 + f2[k] * z2 - turn * bounce.d[k]);
    }
  }
  return v;
}

}  // namespace catoptric::methods::perturbation
