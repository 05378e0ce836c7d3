// Vectors of three components of any scalar type (double, or high precision in tests), and planes.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

namespace catoptric::methods::perturbation {

template <class S>
struct Vector {
  std::array<S, 3> v{};
  S& operator[](std::size_t i) { return v[i]; }
  const S& operator[](std::size_t i) const { return v[i]; }
};

template <class S>
Vector<S> operator+(const Vector<S>& a, const Vector<S>& b) {
  return {{a[0] + b[0], a[1] + b[1], a[2] + b[2]}};
}
template <class S>
Vector<S> operator-(const Vector<S>& a, const Vector<S>& b) {
  return {{a[0] - b[0], a[1] - b[1], a[2] - b[2]}};
}
template <class S>
Vector<S> operator*(const S& s, const Vector<S>& a) {
  return {{s * a[0], s * a[1], s * a[2]}};
}
template <class S>
S dot(const Vector<S>& a, const Vector<S>& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
template <class S>
Vector<S> cross(const Vector<S>& a, const Vector<S>& b) {
  return {{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]}};
}
template <class S>
S length(const Vector<S>& a) {
  using std::sqrt;
  return sqrt(dot(a, a));
}
template <class S>
Vector<S> normalized(const Vector<S>& a) {
  return (S(1) / length(a)) * a;
}

/// dot(normal, x) = offset; the normal has unit length.
template <class S>
struct Plane {
  Vector<S> normal;
  S offset;
};
template <class S>
Vector<S> mirrored(const Plane<S>& plane, const Vector<S>& point) {
  return point - S(2 * (dot(plane.normal, point) - plane.offset)) * plane.normal;
}

}  // namespace catoptric::methods::perturbation
