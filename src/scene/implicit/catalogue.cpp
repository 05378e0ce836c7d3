#include <cmath>
#include <string>

#include "core/error.h"
#include "scene/implicit/surface.h"

namespace catoptric::implicit {
namespace {

/// Domains reach this far beyond what they hold, so that rounding cuts nothing off.
constexpr double kMargin = 1e-3;

void requirePositive(const char* surface, const char* what, double v) {
  if (!(v > 0.0) || !std::isfinite(v)) {
    throw SceneError(std::string(surface) + ": " + what + " is " + std::to_string(v) +
                     "; must be above 0 and finite");
  }
}

void requireDomain(std::string_view surface, const Domain& d) {
  if (d.empty() || !std::isfinite(d.diameter())) {
    throw SceneError(std::string(surface) +
                     ": its domain must be a finite box with min <= max on every axis");
  }
}

Domain symmetric(const Point& half) {
  return {-half, half};
}

/// The diagonal quadric sum k_i x_i^2 + d = 0.
Surface diagonalQuadric(const Point& k, double d, const Domain& domain) {
  return quadricSurface({k.x, k.y, k.z, 0, 0, 0, 0, 0, 0, d}, domain);
}

}  // namespace

Surface formulaSurface(std::string_view formula, const std::vector<Parameter>& parameters,
                       const Domain& domain, std::string_view what) {
  requireDomain(what, domain);
  Surface surface;
  surface.tape = parseFormula(formula, parameters, what);
  surface.domain = domain;
  return surface;
}

Surface quadricSurface(const QuadricCoefficients& c, const Domain& domain) {
  for (const double v : c) {
    if (!std::isfinite(v)) throw SceneError("quadric: a coefficient is not finite");
  }
  // Terms that are zero are left out: a sphere's formula has 8 operations, not 30.
  constexpr std::array<const char*, 10> kTerms{"x^2", "y^2", "z^2", "x*y", "x*z",
                                               "y*z", "x",   "y",   "z",   "1"};
  std::string formula;
  std::vector<Parameter> parameters;
  for (std::size_t i = 0; i < c.size(); ++i) {
    if (c[i] == 0.0) continue;
    const std::string name = "c" + std::to_string(i);
    formula += (formula.empty() ? "" : " + ") + name + "*" + kTerms[i];
    parameters.emplace_back(name, c[i]);
  }
  if (formula.empty()) throw SceneError("quadric: all coefficients are 0");
  Surface surface = formulaSurface(formula, parameters, domain, "quadric");
  surface.quadric = c;
  return surface;
}

Surface planeSurface(const Point& normal, double offset, const Domain& domain) {
  requirePositive("plane", "the length of its normal", glm::length(normal));
  const Point n = glm::normalize(normal);
  return quadricSurface({0, 0, 0, 0, 0, 0, n.x, n.y, n.z, -offset / glm::length(normal)}, domain);
}

Surface sphereSurface(double radius) {
  requirePositive("sphere", "the radius", radius);
  return diagonalQuadric(Point(1.0), -radius * radius, symmetric(Point((1.0 + kMargin) * radius)));
}

Surface ellipsoidSurface(const Point& radii) {
  for (int i = 0; i < 3; ++i) requirePositive("ellipsoid", "a radius", radii[i]);
  return diagonalQuadric(1.0 / (radii * radii), -1.0, symmetric((1.0 + kMargin) * radii));
}

Surface cylinderSurface(double radius, double height) {
  requirePositive("cylinder", "the radius", radius);
  requirePositive("cylinder", "the height", height);
  const double r = (1.0 + kMargin) * radius;
  return diagonalQuadric({1.0, 0.0, 1.0}, -radius * radius, symmetric({r, 0.5 * height, r}));
}

Surface coneSurface(double radius, double height) {
  requirePositive("cone", "the radius", radius);
  requirePositive("cone", "the height", height);
  const double slope = radius / height;
  const double r = (1.0 + kMargin) * radius;
  return diagonalQuadric({1.0, -slope * slope, 1.0}, 0.0, {{-r, -height, -r}, {r, 0.0, r}});
}

Surface torusSurface(double radius, double tube) {
  requirePositive("torus", "the radius", radius);
  requirePositive("torus", "the tube's radius", tube);
  const double r = (1.0 + kMargin) * (radius + tube);
  return formulaSurface("(sqrt(x^2 + z^2) - r)^2 + y^2 - t^2", {{"r", radius}, {"t", tube}},
                        symmetric({r, (1.0 + kMargin) * tube, r}), "torus");
}

Surface superquadricSurface(const Point& radii, double e, double n) {
  for (int i = 0; i < 3; ++i) requirePositive("superquadric", "a radius", radii[i]);
  for (const double v : {e, n}) {
    if (!(v >= 0.1 && v <= 4.0)) {
      throw SceneError("superquadric: an exponent is " + std::to_string(v) +
                       "; must be in 0.1 .. 4");
    }
  }
  return formulaSurface("(abs(x/a)^p + abs(z/c)^p)^q + abs(y/b)^s - 1",
                        {{"a", radii.x},
                         {"b", radii.y},
                         {"c", radii.z},
                         {"p", 2.0 / e},
                         {"q", e / n},
                         {"s", 2.0 / n}},
                        symmetric((1.0 + kMargin) * radii), "superquadric");
}

Surface metaballsSurface(const std::vector<glm::dvec4>& balls, double sharpness) {
  requirePositive("metaballs", "the sharpness", sharpness);
  if (balls.empty()) throw SceneError("metaballs: there are none");
  std::string formula = "1";
  std::vector<Parameter> parameters{{"s", sharpness}};
  // Where every ball gives less than its share of 1 there is no surface.
  const double reach = std::sqrt(1.0 + std::log(static_cast<double>(balls.size())) / sharpness);
  Domain domain;
  for (std::size_t i = 0; i < balls.size(); ++i) {
    const glm::dvec4& ball = balls[i];
    requirePositive("metaballs", "a radius", ball.w);
    const std::string k = std::to_string(i);
    formula +=
        " - exp(s*(1 - ((x-x" + k + ")^2 + (y-y" + k + ")^2 + (z-z" + k + ")^2)/r" + k + "))";
    parameters.insert(
        parameters.end(),
        {{"x" + k, ball.x}, {"y" + k, ball.y}, {"z" + k, ball.z}, {"r" + k, ball.w * ball.w}});
    const double r = (1.0 + kMargin) * reach * ball.w;
    domain.extend(Point(ball) - r);
    domain.extend(Point(ball) + r);
  }
  return formulaSurface(formula, parameters, domain, "metaballs");
}

Surface revolutionSurface(const std::vector<double>& coefficients, double yMin, double yMax) {
  if (coefficients.empty()) throw SceneError("surface of revolution: no coefficients");
  requirePositive("surface of revolution", "the height", yMax - yMin);
  // Horner's scheme, for the formula and for the largest radius.
  std::string profile;
  std::vector<Parameter> parameters;
  for (std::size_t i = coefficients.size(); i-- > 0;) {
    const std::string name = "c" + std::to_string(i);
    parameters.emplace_back(name, coefficients[i]);
    profile = profile.empty() ? name : "(" + profile + ")*y + " + name;
  }
  double radius = 0.0;
  constexpr int kPieces = 64;
  for (int piece = 0; piece < kPieces; ++piece) {
    const double step = (yMax - yMin) / kPieces;
    const Interval y{yMin + step * piece, yMin + step * (piece + 1)};
    Interval r{0.0, 0.0};
    for (std::size_t i = coefficients.size(); i-- > 0;)
      r = r * y + Interval{coefficients[i], coefficients[i]};
    radius = std::max(radius, r.hi);
  }
  requirePositive("surface of revolution", "the largest radius", radius);
  const double r = (1.0 + kMargin) * radius;
  return formulaSurface("sqrt(x^2 + z^2) - (" + profile + ")", parameters,
                        {{-r, yMin, -r}, {r, yMax, r}}, "surface of revolution");
}

Surface vaseSurface() {
  // a t^3 + b t^2 + c t + d with t = y / h
  constexpr double kHeight = 2.0;
  return revolutionSurface(
      {0.47, 3.90 / kHeight, -9.78 / (kHeight * kHeight), 5.80 / (kHeight * kHeight * kHeight)},
      0.0, kHeight);
}

}  // namespace catoptric::implicit
