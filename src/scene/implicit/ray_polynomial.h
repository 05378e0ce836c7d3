// A formula along a piece of a ray as a polynomial, by its coefficients in Bernstein's basis: their
// signs bound the number of zeros. Cheaper than interval arithmetic, and its bounds are tighter.
#pragma once

#include <array>
#include <utility>

#include "scene/implicit/surface.h"

namespace catoptric::implicit {

/// For formulas of + - * and whole powers, and division by constants; with one square root r as
/// well: such a g is p + q r, and the polynomial p^2 - q^2 r^2 = g (p - q r) is zero wherever g is.
class RayPolynomial {
 public:
  static constexpr std::size_t kMaxDegree = 12;      ///< ours
  static constexpr std::size_t kMaxOperations = 48;  ///< of the tape (ours)

  enum class Zeros { None, AtMostOne, Unknown };
  /// Bernstein's coefficients over a piece.
  using Coefficients = std::array<double, kMaxDegree + 1>;

  /// From `origin` to `origin + way`, local space.
  RayPolynomial(const Tape& tape, const Point& origin, const Point& way);
  /// Whether there is one that says more than its rounding.
  bool valid() const { return valid_; }
  const Coefficients& whole() const { return whole_; }
  Zeros zeros(const Coefficients& piece) const;
  /// About where the only zero is, as a part of the piece.
  double zeroNear(const Coefficients& piece) const;
  /// A piece's first and second half; for at most kMaxHalvings in a row.
  static constexpr int kMaxHalvings = 12;  ///< ours
  std::pair<Coefficients, Coefficients> halves(const Coefficients& piece) const;

 private:
  Coefficients whole_;
  std::size_t degree_ = 0;
  double error_ = 0.0;  ///< of each coefficient, halved ones too, at most
  bool valid_ = false;
};

}  // namespace catoptric::implicit
