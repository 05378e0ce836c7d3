#include "scene/implicit/ray_polynomial.h"

#include <algorithm>
#include <cmath>

namespace catoptric::implicit {
namespace {

constexpr std::size_t kMost = RayPolynomial::kMaxDegree;
/// Of one operation on doubles.
constexpr double kRounding = 0x1p-53;

/// binomial(n, k)
constexpr auto kBinomials = [] {
  std::array<std::array<double, kMost + 1>, kMost + 1> table{};
  for (std::size_t n = 0; n <= kMost; ++n) {
    table[n][0] = table[n][n] = 1.0;
    for (std::size_t k = 1; k < n; ++k) table[n][k] = table[n - 1][k - 1] + table[n - 1][k];
  }
  return table;
}();

/// sum c_i u^i (1 - u)^(degree - i): Bernstein's coefficients times binomials, so that products are
/// convolutions.
struct Polynomial {
  std::array<double, kMost + 1> c;  ///< up to the degree
  std::size_t degree;
  double size;   ///< Bernstein's coefficients at most
  double error;  ///< theirs at most
};

Polynomial constant(double v) {
  Polynomial r;
  r.c[0] = v;
  r.degree = 0;
  r.size = std::abs(v);
  r.error = 0.0;
  return r;
}
Polynomial coordinate(double from, double way) {
  Polynomial r;
  r.c[0] = from;
  r.c[1] = from + way;
  r.degree = 1;
  r.size = std::max(std::abs(r.c[0]), std::abs(r.c[1]));
  r.error = 2.0 * kRounding * (std::abs(from) + std::abs(way));
  return r;
}
bool isZero(const Polynomial& a) {
  return a.size == 0.0;
}

/// The same with a higher degree.
void raise(Polynomial& a, std::size_t degree) {
  for (; a.degree < degree; ++a.degree) {
    a.c[a.degree + 1] = a.c[a.degree];
    for (std::size_t i = a.degree; i > 0; --i) a.c[i] += a.c[i - 1];
    a.error += 2.0 * kRounding * a.size;
  }
}
/// a + sign b
Polynomial sum(const Polynomial& a, const Polynomial& b, double sign) {
  Polynomial r = a;
  raise(r, b.degree);
  Polynomial raised;
  if (b.degree < a.degree) {
    raised = b;
    raise(raised, a.degree);
  }
  const Polynomial& other = b.degree < a.degree ? raised : b;
  for (std::size_t i = 0; i <= r.degree; ++i) r.c[i] += sign * other.c[i];
  r.size += b.size;
  r.error += other.error + 2.0 * kRounding * r.size;
  return r;
}
Polynomial product(const Polynomial& a, const Polynomial& b) {
  Polynomial r;
  r.degree = a.degree + b.degree;
  std::fill_n(r.c.begin(), r.degree + 1, 0.0);
  for (std::size_t i = 0; i <= a.degree; ++i) {
    for (std::size_t j = 0; j <= b.degree; ++j) r.c[i + j] += a.c[i] * b.c[j];
  }
  r.size = a.size * b.size;
  const auto operations = static_cast<double>(2 + std::min(a.degree, b.degree));
  r.error =
      a.error * b.size + a.size * b.error + a.error * b.error + operations * kRounding * r.size;
  return r;
}

/// p + q r, r the formula's root.
struct Surd {
  Polynomial p;
  Polynomial q;
};

/// Both of degree kMost at most, afterwards too.
bool multiply(const Surd& a, const Surd& b, const Polynomial& root2, Surd& r) {
  const bool plain = isZero(a.q) && isZero(b.q);
  const std::size_t degree = std::max(a.p.degree, a.q.degree) + std::max(b.p.degree, b.q.degree) +
                             (plain ? 0 : root2.degree);
  if (degree > kMost) return false;
  r.p = product(a.p, b.p);
  r.q = constant(0.0);
  if (plain) return true;
  r.p = sum(r.p, product(product(a.q, b.q), root2), 1.0);
  r.q = sum(product(a.p, b.q), product(a.q, b.p), 1.0);
  return true;
}

/// p, or p^2 - q^2 r^2 where there is a root. False: not such a formula.
bool evaluate(const Tape& tape, const Point& origin, const Point& way, Polynomial& result) {
  if (tape.size() > RayPolynomial::kMaxOperations) return false;
  std::array<Surd, RayPolynomial::kMaxOperations> terms;
  Polynomial root2 = constant(0.0);
  bool rooted = false;
  for (std::size_t i = 0; i < tape.size(); ++i) {
    const Operation& op = tape[i];
    const Surd& a = terms[op.a];
    const Surd& b = terms[op.b];
    Surd& r = terms[i];
    switch (op.code) {
      case Code::Constant:
        r = {constant(op.constant), constant(0.0)};
        break;
      case Code::X:
        r = {coordinate(origin.x, way.x), constant(0.0)};
        break;
      case Code::Y:
        r = {coordinate(origin.y, way.y), constant(0.0)};
        break;
      case Code::Z:
        r = {coordinate(origin.z, way.z), constant(0.0)};
        break;
      case Code::Add:
      case Code::Subtract: {
        const double sign = op.code == Code::Add ? 1.0 : -1.0;
        r.p = sum(a.p, b.p, sign);
        r.q = isZero(b.q) ? a.q : sum(a.q, b.q, sign);
        break;
      }
      case Code::Negate:
        r = {sum(constant(0.0), a.p, -1.0), sum(constant(0.0), a.q, -1.0)};
        break;
      case Code::Multiply:
        if (!multiply(a, b, root2, r)) return false;
        break;
      case Code::Square:
        if (!multiply(a, a, root2, r)) return false;
        break;
      case Code::IntegerPower: {
        if (!(op.constant >= 1.0 && op.constant <= static_cast<double>(kMost))) return false;
        r = a;
        for (int k = 1; k < static_cast<int>(op.constant); ++k) {
          const Surd power = r;
          if (!multiply(power, a, root2, r)) return false;
        }
        break;
      }
      case Code::Divide: {
        if (b.p.degree > 0 || !isZero(b.q) || b.p.error > 0.0 || isZero(b.p)) return false;
        const Surd inverse{constant(1.0 / b.p.c[0]), constant(0.0)};
        if (!multiply(a, inverse, root2, r)) return false;
        r.p.error += 2.0 * kRounding * r.p.size;
        r.q.error += 2.0 * kRounding * r.q.size;
        break;
      }
      case Code::Sqrt:
        if (rooted || !isZero(a.q)) return false;
        rooted = true;
        root2 = a.p;
        r = {constant(0.0), constant(1.0)};
        break;
      default:
        return false;
    }
  }
  const Surd& g = terms[tape.size() - 1];
  if (isZero(g.q)) {
    result = g.p;
    return true;
  }
  if (std::max(2 * g.p.degree, 2 * g.q.degree + root2.degree) > kMost) return false;
  result = sum(product(g.p, g.p), product(product(g.q, g.q), root2), -1.0);
  return true;
}

}  // namespace

RayPolynomial::RayPolynomial(const Tape& tape, const Point& origin, const Point& way) {
  Polynomial g;
  if (!evaluate(tape, origin, way, g)) return;
  degree_ = g.degree;
  double largest = 0.0;
  for (std::size_t i = 0; i <= degree_; ++i) {
    whole_[i] = g.c[i] / kBinomials[degree_][i];
    largest = std::max(largest, std::abs(whole_[i]));
  }
  // Each halving takes as many means as the degree
  error_ = g.error + static_cast<double>(1 + (1 + kMaxHalvings) * degree_) * kRounding * g.size;
  valid_ = std::isfinite(error_) && std::isfinite(largest) && largest > error_;
}

RayPolynomial::Zeros RayPolynomial::zeros(const Coefficients& piece) const {
  double low = piece[0];
  double high = piece[0];
  double least = std::numeric_limits<double>::infinity();  // of the differences
  double most = -least;
  for (std::size_t i = 1; i <= degree_; ++i) {
    low = std::min(low, piece[i]);
    high = std::max(high, piece[i]);
    least = std::min(least, piece[i] - piece[i - 1]);
    most = std::max(most, piece[i] - piece[i - 1]);
  }
  if (low > error_ || high < -error_) return Zeros::None;
  // It only rises, or only falls
  const double slack = 2.0 * error_ + 2.0 * kRounding * std::max(std::abs(low), std::abs(high));
  if (least > slack || most < -slack) return Zeros::AtMostOne;
  // Descartes: no more zeros than changes of sign. One that rounding leaves open adds none between
  // different signs, one at an end, two between equal signs.
  int changes = 0;
  int last = 0;
  for (std::size_t i = 0; i <= degree_; ++i) {
    const int sign = piece[i] > error_ ? 1 : piece[i] < -error_ ? -1 : 0;
    if (sign == 0) {
      const bool end = i == 0 || i == degree_;
      if (i < degree_ && std::abs(piece[i + 1]) <= error_) return Zeros::Unknown;
      if (end) ++changes;
      if (!end && last != 0 && (piece[i + 1] > 0.0) == (last > 0)) changes += 2;
      continue;
    }
    if (last != 0 && sign != last) ++changes;
    last = sign;
  }
  return changes <= 1 ? Zeros::AtMostOne : Zeros::Unknown;
}

double RayPolynomial::zeroNear(const Coefficients& piece) const {
  // By powers of u: differences
  Coefficients c = piece;
  for (std::size_t k = 1; k <= degree_; ++k) {
    for (std::size_t i = degree_; i >= k; --i) c[i] -= c[i - 1];
  }
  for (std::size_t k = 1; k <= degree_; ++k) c[k] *= kBinomials[degree_][k];
  // Newton's method inside the bracket, and halving where it leaves that
  constexpr int kSteps = 6;
  constexpr double kDone = 1e-4;
  double from = 0.0;
  double to = 1.0;
  double u = piece[0] / (piece[0] - piece[degree_]);
  for (int step = 0; step < kSteps; ++step) {
    if (!(u > from && u < to)) u = 0.5 * (from + to);
    double value = c[degree_];
    double slope = 0.0;
    for (std::size_t k = degree_; k-- > 0;) {
      slope = slope * u + value;
      value = value * u + c[k];
    }
    ((value < 0.0) == (piece[0] < 0.0) ? from : to) = u;
    const double move = value / slope;
    u -= move;
    if (std::abs(move) < kDone) break;
  }
  return u > from && u < to ? u : 0.5 * (from + to);
}

std::pair<RayPolynomial::Coefficients, RayPolynomial::Coefficients> RayPolynomial::halves(
    const Coefficients& piece) const {
  // de Casteljau
  std::pair<Coefficients, Coefficients> result;
  Coefficients& means = result.second;
  means = piece;
  for (std::size_t k = 0; k <= degree_; ++k) {
    result.first[k] = means[0];
    for (std::size_t i = 0; i + k < degree_; ++i) means[i] = 0.5 * (means[i] + means[i + 1]);
  }
  return result;
}

}  // namespace catoptric::implicit
