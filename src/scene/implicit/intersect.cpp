// Rays and implicit surfaces.
#include <cmath>

#include "scene/implicit/ray_polynomial.h"

namespace catoptric::implicit {
namespace {

/// A ray in local space from where it enters the domain: o + s d with s in [0, length].
struct Segment {
  Point origin;
  Point direction;
  double start = 0.0;   ///< t = start + s
  double length = 0.0;  ///< negative: outside
};

Segment clipped(const Surface& surface, const SurfaceRay& ray) {
  Segment segment;
  const Point origin = surface.localFromWorld(ray.origin);
  segment.direction = surface.localFromWorld.linear * ray.direction;
  double begin = ray.tMin;
  double end = ray.tMax;
  for (int axis = 0; axis < 3; ++axis) {
    const double d = segment.direction[axis];
    const double o = origin[axis];
    if (d == 0.0) {
      if (!(o >= surface.domain.min[axis] && o <= surface.domain.max[axis])) begin = end + 1.0;
      continue;
    }
    const double a = (surface.domain.min[axis] - o) / d;
    const double b = (surface.domain.max[axis] - o) / d;
    begin = std::max(begin, std::min(a, b));
    end = std::min(end, std::max(a, b));
  }
  segment.start = begin;
  // From a near origin the coordinates keep all their digits.
  segment.origin = origin + begin * segment.direction;
  segment.length = (begin <= end && std::isfinite(end - begin)) ? end - begin : -1.0;
  return segment;
}

/// g along a segment.
class Along {
 public:
  Along(const Tape& tape, const Segment& segment)
      : segment_(segment), plain_(tape), slope_(tape), values_(tape), boxes_(tape) {}

  double value(double s) {
    const Point p = segment_.origin + s * segment_.direction;
    return plain_(p.x, p.y, p.z);
  }
  Dual<double> valueAndSlope(double s) {
    const Point p = segment_.origin + s * segment_.direction;
    const Point& d = segment_.direction;
    return slope_({p.x, d.x}, {p.y, d.y}, {p.z, d.z});
  }
  Dual<Interval> range(const Interval& s) {
    const auto slope = [&](int axis) {
      return Interval{segment_.direction[axis], segment_.direction[axis]};
    };
    return boxes_({at(0, s), slope(0)}, {at(1, s), slope(1)}, {at(2, s), slope(2)});
  }
  Interval valueRange(const Interval& s) { return values_(at(0, s), at(1, s), at(2, s)); }

 private:
  Interval at(int axis, const Interval& s) const {
    const double o = segment_.origin[axis];
    return Interval{o, o} + segment_.direction[axis] * s;
  }

  Segment segment_;
  Evaluator<double> plain_;
  Evaluator<Dual<double>> slope_;
  Evaluator<Interval> values_;
  Evaluator<Dual<Interval>> boxes_;
};

/// A zero of g between a and b, where its signs differ: Newton's method from s, halving where it
/// leaves the bracket or does not halve it, until steps are below `rounding`. nullopt for a pole or
/// a jump.
std::optional<double> refined(Along& g, double a, double b, double ga, double gb, double s,
                              double rounding) {
  const double before = std::max(std::abs(ga), std::abs(gb));
  constexpr int kSteps = 200;
  double lastStep = b - a;
  for (int step = 0; step < kSteps; ++step) {
    const Dual<double> v = g.valueAndSlope(s);
    if (!std::isfinite(v.value)) return std::nullopt;
    if (v.value == 0.0) return s;
    ((v.value < 0.0) == (ga < 0.0) ? a : b) = s;
    ((v.value < 0.0) == (ga < 0.0) ? ga : gb) = v.value;
    double next = s - v.value / v.derivative;
    if (std::abs(next - s) <= rounding) break;
    const bool slow = !(std::abs(next - s) < 0.5 * lastStep);
    if (!(next > a && next < b) || slow) next = 0.5 * (a + b);
    lastStep = std::abs(next - s);
    if (next == s || next <= a || next >= b) break;
    s = next;
  }
  // At a pole the values grow, at a jump they stay.
  constexpr double kFall = 0.5;
  if (std::min(std::abs(ga), std::abs(gb)) > kFall * before) return std::nullopt;
  return std::abs(ga) < std::abs(gb) ? a : b;
}

/// The zeros of a quadratic a s^2 + b s + c in order, those that change its sign.
int quadraticRoots(double a, double b, double c, std::array<double, 2>& roots) {
  if (a == 0.0) {
    if (b == 0.0) return 0;
    roots[0] = -c / b;
    return 1;
  }
  // b^2 - 4 a c with one rounding [Kahan2004].
  const double p = b * b;
  const double q = 4.0 * a * c;
  const double discriminant = (p - q) + (std::fma(b, b, -p) - std::fma(4.0 * a, c, -q));
  if (!(discriminant > 0.0)) return 0;
  const double w = -0.5 * (b + std::copysign(std::sqrt(discriminant), b));
  roots = {w / a, c / w};
  if (w == 0.0) roots[1] = 0.0;
  if (roots[0] > roots[1]) std::swap(roots[0], roots[1]);
  return 2;
}

void quadricHits(const Surface& surface, const Segment& segment, std::size_t most,
                 std::vector<double>& hits) {
  const QuadricCoefficients& q = *surface.quadric;
  const glm::dmat3 m(q[0], 0.5 * q[3], 0.5 * q[4], 0.5 * q[3], q[1], 0.5 * q[5], 0.5 * q[4],
                     0.5 * q[5], q[2]);
  const Point linear(q[6], q[7], q[8]);
  // About the middle of the segment, where rounding is least.
  const double middle = 0.5 * segment.length;
  const Point o = segment.origin + middle * segment.direction;
  const Point& d = segment.direction;
  const double a = glm::dot(d, m * d);
  const double b = 2.0 * glm::dot(d, m * o) + glm::dot(linear, d);
  const double c = glm::dot(o, m * o) + glm::dot(linear, o) + q[9];
  std::array<double, 2> roots{};
  const int count = quadraticRoots(a, b, c, roots);
  for (int i = 0; i < count && hits.size() < most; ++i) {
    const double s = middle + roots[static_cast<std::size_t>(i)];
    if (s >= 0.0 && s <= segment.length) hits.push_back(segment.start + s);
  }
}

struct Piece {
  double a, b;
  double ga, gb;  ///< values at the ends: each end is evaluated once, so no sign is seen twice
  bool crosses() const {
    return std::isfinite(ga) && std::isfinite(gb) && (ga < 0.0) != (gb < 0.0);
  }
};

/// One search along a segment.
class Search {
 public:
  Search(const Surface& surface, const Segment& segment, std::size_t most,
         std::vector<double>& hits)
      : surface_(surface),
        segment_(segment),
        g_(surface.tape, segment),
        rounding_(std::numeric_limits<double>::epsilon() *
                  (std::abs(segment.start) + segment.length)),
        resolution_(std::max(kRayResolution * segment.length, 8.0 * rounding_)),
        most_(most),
        hits_(hits) {}

  SurfaceHit run() {
    const RayPolynomial polynomial(surface_.tape, segment_.origin,
                                   segment_.length * segment_.direction);
    if (polynomial.valid()) {
      halve(polynomial, polynomial.whole(), 0.0, segment_.length, 0);
    } else {
      byIntervals(pieceOf(0.0, segment_.length));
    }
    return result_;
  }

 private:
  bool done() const { return hits_.size() >= most_ || result_.status == HitStatus::Unresolved; }
  /// Counts one that is looked at.
  bool tooMany() {
    if (++boxes_ > kMaxRayBoxes) result_.status = HitStatus::Unresolved;
    return boxes_ > kMaxRayBoxes;
  }
  Piece pieceOf(double a, double b) { return {a, b, g_.value(a), g_.value(b)}; }
  /// About at `part` of the piece.
  void addRoot(const Piece& piece, double part) {
    const double s = std::clamp(piece.a + part * (piece.b - piece.a), piece.a, piece.b);
    if (const auto root = refined(g_, piece.a, piece.b, piece.ga, piece.gb, s, rounding_))
      hits_.push_back(segment_.start + *root);
  }

  /// In order; what the polynomial's signs leave open by intervals.
  void halve(const RayPolynomial& polynomial, const RayPolynomial::Coefficients& coefficients,
             double a, double b, int halvings) {
    if (done() || tooMany()) return;
    const RayPolynomial::Zeros zeros = polynomial.zeros(coefficients);
    if (zeros == RayPolynomial::Zeros::None) return;
    if (zeros == RayPolynomial::Zeros::AtMostOne || halvings == RayPolynomial::kMaxHalvings) {
      const Piece piece = pieceOf(a, b);
      const bool finite = std::isfinite(piece.ga) && std::isfinite(piece.gb);
      if (zeros != RayPolynomial::Zeros::AtMostOne || !finite) {
        byIntervals(piece);
      } else if (piece.crosses()) {
        addRoot(piece, polynomial.zeroNear(coefficients));
      }
      return;
    }
    const auto halves = polynomial.halves(coefficients);
    const double middle = 0.5 * (a + b);
    halve(polynomial, halves.first, a, middle, halvings + 1);
    halve(polynomial, halves.second, middle, b, halvings + 1);
  }

  void byIntervals(const Piece& whole) {
    std::vector<Piece> stack{whole};
    while (!stack.empty() && !done()) {
      const Piece piece = stack.back();
      stack.pop_back();
      if (tooMany()) return;
      const Interval s{piece.a, piece.b};
      const Dual<Interval> range = g_.range(s);
      if (range.value.undefined() || !range.value.containsZero()) continue;
      // g = 0 on all of a piece: not a surface.
      if (range.value.lo == 0.0 && range.value.hi == 0.0 && piece.b > piece.a) {
        result_.status = HitStatus::Unresolved;
        return;
      }
      const bool monotone = range.derivative.bounded() && !range.derivative.containsZero();
      const double middle = 0.5 * (piece.a + piece.b);
      if (monotone && !piece.crosses()) continue;
      // The mean value theorem bounds g where its derivative is bounded.
      if (!monotone && range.derivative.bounded()) {
        const Interval mean =
            g_.valueRange({middle, middle}) + range.derivative * (s + Interval{-middle, -middle});
        if (!mean.undefined() && !mean.containsZero()) continue;
      }
      if (monotone || piece.b - piece.a <= resolution_ || middle <= piece.a || middle >= piece.b) {
        if (piece.crosses()) {
          addRoot(piece, 0.5);
        } else {
          result_.grazing = true;
        }
        continue;
      }
      const double gm = g_.value(middle);
      stack.push_back({middle, piece.b, gm, piece.gb});
      stack.push_back({piece.a, middle, piece.ga, gm});
    }
  }

  const Surface& surface_;
  Segment segment_;
  Along g_;
  double rounding_;  ///< of t
  double resolution_;
  std::size_t most_;
  std::vector<double>& hits_;
  SurfaceHit result_;
  int boxes_ = 0;
};

SurfaceHit find(const Surface& surface, const SurfaceRay& ray, std::size_t most,
                std::vector<double>& hits) {
  const Segment segment = clipped(surface, ray);
  if (segment.length < 0.0) return {};
  if (surface.quadric) {
    quadricHits(surface, segment, most, hits);
    return {};
  }
  return Search(surface, segment, most, hits).run();
}

}  // namespace

SurfaceHit firstHit(const Surface& surface, const SurfaceRay& ray) {
  std::vector<double> hits;
  SurfaceHit hit = find(surface, ray, 1, hits);
  if (!hits.empty()) {
    hit.status = HitStatus::Hit;
    hit.t = hits[0];
  }
  return hit;
}

std::vector<double> allHits(const Surface& surface, const SurfaceRay& ray, HitStatus& status) {
  std::vector<double> hits;
  const SurfaceHit found = find(surface, ray, std::numeric_limits<std::size_t>::max(), hits);
  status = found.status == HitStatus::Miss && !hits.empty() ? HitStatus::Hit : found.status;
  return hits;
}

}  // namespace catoptric::implicit
