// The restriction of a formula to a piece of a ray, as a polynomial in the Bernstein basis. The
// signs of its coefficients bound the number of zeros. This is cheaper than interval arithmetic,
// and its bounds are tighter.
#pragma once

#include <array>
#include <utility>

#include "scene/implicit/surface.h"

namespace catoptric::implicit {

/// Handles formulas of + - * and whole powers, division by constants, and at most one square root
/// r. A formula with a root has the form g = p + q r; the polynomial p^2 - q^2 r^2 = g (p - q r) is
/// zero wherever g is.
class RayPolynomial {
 public:
  static constexpr std::size_t kMaxDegree = 12;      ///< our choice
  static constexpr std::size_t kMaxOperations = 48;  ///< of the tape; our choice

  enum class Zeros { None, AtMostOne, Unknown };
  /// Bernstein coefficients over a piece of the ray.
  using Coefficients = std::array<double, kMaxDegree + 1>;

  /// The piece from `origin` to `origin + way`, in local space.
  RayPolynomial(const Tape& tape, const Point& origin, const Point& way);
  /// Whether such a polynomial exists and its coefficients exceed their rounding errors.
  bool valid() const { return valid_; }
  const Coefficients& whole() const { return whole_; }
  Zeros zeros(const Coefficients& piece) const;
  /// The approximate position of the only zero, as a fraction of the piece.
  double zeroNear(const Coefficients& piece) const;
  /// How often a piece may be halved.
  static constexpr int kMaxHalvings = 12;  ///< our choice
  std::pair<Coefficients, Coefficients> halves(const Coefficients& piece) const;

 private:
  Coefficients whole_;
  std::size_t degree_ = 0;
  double error_ = 0.0;  ///< bound on the error of each coefficient, also after halving
  bool valid_ = false;
};

}  // namespace catoptric::implicit
