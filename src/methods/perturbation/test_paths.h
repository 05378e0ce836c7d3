// Paths over real surfaces for tests: traced from q in double, made exact in 50 digits.
#pragma once

#include <random>
#include <string>

#include "methods/perturbation/test_path_calculus.h"
#include "methods/perturbation/turn.h"
#include "scene/implicit/multiprecision_test.h"
#include "scene/implicit/surface.h"

namespace catoptric::methods::perturbation {

using implicit::Point;
using implicit::Real;
using implicit::Surface;

template <class To, class From>
Vector<To> converted(const Vector<From>& v) {
  return {{static_cast<To>(v[0]), static_cast<To>(v[1]), static_cast<To>(v[2])}};
}

template <class S>
Jet3<S> jetAt(const Surface& surface, const Vector<S>& x) {
  const auto seeds = implicit::seedsAt<S>(surface.localFromWorld, x.v);
  return implicit::Evaluator<Jet3<S>>(surface.tape)(seeds[0], seeds[1], seeds[2]);
}

/// A path over some of `surfaces`.
struct TestPath {
  std::vector<Surface> surfaces;
  std::vector<std::size_t> hit;  ///< which surface x_i is on
  Vector<double> p, q;
  std::vector<Vector<double>> points;
  std::vector<double> indices;  ///< N + 1 indices of refraction; empty: 1

  template <class S>
  S index(std::size_t segment) const {
    return indices.empty() ? S(1) : S(indices[segment]);
  }
  /// Finds the exact path from `start` to q, beginning at `vertices` (if empty: at `points`).
  template <class S>
  bool solve(const Vector<S>& start, std::vector<PathVertex<S>>& vertices) const {
    if (vertices.empty()) {
      for (std::size_t i = 0; i < points.size(); ++i)
        vertices.push_back({converted<S>(points[i]), {}, index<S>(i)});
    }
    const auto surfaceAt = [&](std::size_t i, const Vector<S>& x, Jet3<S>& jet) {
      jet = jetAt<S>(surfaces[hit[i]], x);
      return true;
    };
    // After a step of this relative length, the error is about its square.
    const S tolerance = std::is_same_v<S, double> ? S(1e-13) : S(1e-27);
    return solvePath<S>(start, converted<S>(q), surfaceAt, index<S>(points.size()), tolerance,
                        vertices);
  }
};

/// Follows a mirror ray from q over `bounces` hits, of which the first is on surface 0. Sets p
/// half-way to the surface that the ray hits next. Returns false if the ray hits no surface, grazes
/// one, or hits one too soon.
inline bool tracePath(TestPath& path, const Point& direction, std::size_t bounces) {
  path.hit.clear();
  path.points.clear();
  Point o = pointOf(path.q);
  Point d = glm::normalize(direction);
  for (std::size_t bounce = 0; bounce <= bounces; ++bounce) {
    double nearest = std::numeric_limits<double>::infinity();
    std::size_t which = 0;
    for (std::size_t i = 0; i < path.surfaces.size(); ++i) {
      const auto hit = implicit::firstHit(path.surfaces[i], {o, d, 1e-6});
      if (hit.status == implicit::HitStatus::Hit && hit.t < nearest) {
        nearest = hit.t;
        which = i;
      }
    }
    if (!std::isfinite(nearest) || (bounce == 0 && which != 0)) return false;
    if (bounce == bounces) {
      path.p = vectorOf(o + 0.5 * nearest * d);
      break;
    }
    const Point x = o + nearest * d;
    Jet3<double> jet;
    if (implicit::derivativesAt(path.surfaces[which], x, jet) != implicit::PointStatus::Smooth)
      return false;
    const Point n = glm::normalize(Point(jet.c[1], jet.c[2], jet.c[3]));
    constexpr double kLeastCosine = 0.2;
    if (std::abs(glm::dot(n, d)) < kLeastCosine || nearest < 0.05) return false;
    // Points are ordered from p to q, and the ray starts at q: its first hit is the last point,
    // x_N.
    path.points.insert(path.points.begin(), vectorOf(x));
    path.hit.insert(path.hit.begin(), which);
    o = x;
    d = glm::reflect(d, n);
  }
  return true;
}

inline Point randomDirection(std::mt19937& random) {
  std::normal_distribution<double> normal;
  return glm::normalize(Point(normal(random), normal(random), normal(random)));
}

}  // namespace catoptric::methods::perturbation
