#include "scene/implicit/gradient.h"

#include <cmath>

namespace catoptric::implicit {
namespace {

struct Slope {
  double value = 0.0;
  Point gradient{0.0};  ///< by world coordinates
};

/// One pass of duals per axis of local space, then the chain rule.
Slope slopeAt(Evaluator<Dual<double>>& evaluate, const Surface& surface, const Point& world) {
  const Point p = surface.localFromWorld(world);
  Slope slope;
  Point local;
  for (int axis = 0; axis < 3; ++axis) {
    const auto seed = [&](int i) { return Dual<double>{p[i], i == axis ? 1.0 : 0.0}; };
    const Dual<double> g = evaluate(seed(0), seed(1), seed(2));
    slope.value = g.value;
    local[axis] = g.derivative;
  }
  slope.gradient = glm::transpose(surface.localFromWorld.linear) * local;
  return slope;
}

}  // namespace

std::optional<Point> gradientAt(const Surface& surface, const Point& world) {
  Evaluator<Dual<double>> evaluate(surface.tape);
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
  Evaluator<Dual<double>> evaluate(surface.tape);
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
