#include "scene/implicit/gradient.h"

#include <cmath>

namespace catoptric::implicit {

/// A value and its derivatives by x, y and z: three duals that share the value.
struct Slope {
  double value = 0.0;
  Point gradient{0.0};
};
static Slope operator+(const Slope& a, const Slope& b) {
  return {a.value + b.value, a.gradient + b.gradient};
}
static Slope operator-(const Slope& a, const Slope& b) {
  return {a.value - b.value, a.gradient - b.gradient};
}
static Slope operator-(const Slope& a) {
  return {-a.value, -a.gradient};
}
static Slope operator*(const Slope& a, const Slope& b) {
  return {a.value * b.value, a.value * b.gradient + a.gradient * b.value};
}

template <>
struct Arithmetic<Slope> {
  static Slope constant(double v) { return {v, Point(0.0)}; }
  static Slope apply(Code code, const Slope& u, double c) {
    // Most often, and dearest to call
    if (code == Code::Square) return {u.value * u.value, 2.0 * u.value * u.gradient};
    const Chain<double> f = chainOf<1>(code, u.value, c);
    return {f.f0, f.f1 * u.gradient};
  }
  static Slope quotient(const Slope& a, const Slope& b) { return a * apply(Code::Divide, b, 0.0); }
  static Slope smaller(const Slope& a, const Slope& b) { return a.value < b.value ? a : b; }
};

namespace {

/// By world coordinates.
Slope slopeAt(Evaluator<Slope>& evaluate, const Surface& surface, const Point& world) {
  const Point p = surface.localFromWorld(world);
  Slope slope = evaluate({p.x, Point(1.0, 0.0, 0.0)}, {p.y, Point(0.0, 1.0, 0.0)},
                         {p.z, Point(0.0, 0.0, 1.0)});
  slope.gradient = glm::transpose(surface.localFromWorld.linear) * slope.gradient;
  return slope;
}

}  // namespace

std::optional<Point> gradientAt(const Surface& surface, const Point& world) {
  Evaluator<Slope> evaluate(surface.tape);
  const Point gradient = slopeAt(evaluate, surface, world).gradient;
  const double length = glm::length(gradient);
  if (!(length > 0.0) || !std::isfinite(length)) return std::nullopt;
  return gradient;
}

std::optional<Point> normalAt(const Surface& surface, const Point& world) {
  const std::optional<Point> gradient = gradientAt(surface, world);
  if (!gradient) return std::nullopt;
  return *gradient / glm::length(*gradient);
}

std::optional<Point> nearestPoint(const Surface& surface, const Point& world, double reach) {
  constexpr int kSteps = 20;
  constexpr double kDone = 1e-14;  // of the way that the point may go, and of its coordinates
  Evaluator<Slope> evaluate(surface.tape);
  Point p = world;
  for (int step = 0; step < kSteps; ++step) {
    const Slope slope = slopeAt(evaluate, surface, p);
    const double size2 = glm::dot(slope.gradient, slope.gradient);
    if (!(size2 > 0.0) || !std::isfinite(size2) || !std::isfinite(slope.value)) break;
    const Point move = slope.gradient * (slope.value / size2);
    p -= move;
    if (!(glm::length(p - world) <= reach)) break;
    if (glm::length(move) > kDone * (reach + glm::length(p))) continue;
    if (!surface.domain.contains(surface.localFromWorld(p))) break;
    return p;
  }
  return std::nullopt;
}

}  // namespace catoptric::implicit
