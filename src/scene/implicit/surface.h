// Implicit surfaces g(x, y, z) = 0: a catalogue, and any formula. One definition gives values,
// exact derivatives up to the third (jets), bounds, and ray intersections with a stated guarantee.
// All in double. A surface lives in its own space, where its domain is an axis-aligned box, and is
// placed by an affine map; every function below takes and returns world points.
#pragma once

#include <array>
#include <optional>
#include <string_view>
#include <vector>

#include "core/math.h"
#include "scene/implicit/evaluate.h"

namespace catoptric::implicit {

using Point = glm::dvec3;

/// Axis-aligned box, both ends included; empty where min > max.
struct Domain {
  Point min{std::numeric_limits<double>::infinity()};
  Point max{-std::numeric_limits<double>::infinity()};

  bool empty() const { return !(min.x <= max.x && min.y <= max.y && min.z <= max.z); }
  bool contains(const Point& p) const {
    return glm::all(glm::greaterThanEqual(p, min)) && glm::all(glm::lessThanEqual(p, max));
  }
  void extend(const Point& p) {
    min = glm::min(min, p);
    max = glm::max(max, p);
  }
  double diameter() const { return empty() ? 0.0 : glm::length(max - min); }
};

/// local = linear * world + offset
struct Affine {
  glm::dmat3 linear{1.0};
  Point offset{0.0};
  Point operator()(const Point& world) const { return linear * world + offset; }
};

/// xx, yy, zz, xy, xz, yz, x, y, z, 1
using QuadricCoefficients = std::array<double, 10>;

struct Surface {
  Tape tape;                                   ///< g, in local coordinates
  Domain domain;                               ///< the surface ends there (local)
  Affine localFromWorld;                       ///< invertible
  std::optional<QuadricCoefficients> quadric;  ///< g once more: rays have a closed form
};

// ---- Catalogue (local space, y up). Throws SceneError on sizes that are not positive and finite.
/// dot(normal, x) = offset, cut off by `domain`.
Surface planeSurface(const Point& normal, double offset, const Domain& domain);
Surface sphereSurface(double radius);
Surface ellipsoidSurface(const Point& radii);
/// About +y, open at both ends.
Surface cylinderSurface(double radius, double height);
/// Apex in the origin, opening downwards to `radius` at -height, open.
Surface coneSurface(double radius, double height);
/// About +y; radius of the tube's centre line, and of the tube.
Surface torusSurface(double radius, double tube);
Surface quadricSurface(const QuadricCoefficients& coefficients, const Domain& domain);
/// (|x/a|^(2/e) + |z/c|^(2/e))^(e/n) + |y/b|^(2/n) = 1: e rounds around the y axis, n along it,
/// both in 0.1 .. 4. [Barr1981]
Surface superquadricSurface(const Point& radii, double e, double n);
/// sum exp(sharpness (1 - |x - centre|^2 / radius^2)) = 1 [Blinn1982]; w is a ball's radius: a ball
/// that stands alone ends there.
Surface metaballsSurface(const std::vector<glm::dvec4>& balls, double sharpness);
/// sqrt(x^2 + z^2) = sum c_i y^i, between two heights.
Surface revolutionSurface(const std::vector<double>& coefficients, double yMin, double yMax);
/// [Chen2000] Sec. IV, with its axis along y: height 2.
Surface vaseSurface();
/// Whatever `parseFormula` reads.
Surface formulaSurface(std::string_view formula, const std::vector<Parameter>& parameters,
                       const Domain& domain, std::string_view what = "formula");

/// The same surface where `worldFromLocal` puts it, after where it was. Throws SceneError when the
/// map cannot be inverted.
Surface placed(Surface surface, const glm::dmat3& linear, const Point& offset);

// ---- Values ----
enum class PointStatus {
  Smooth,
  NotFinite,    ///< g is NaN or infinite
  NoGradient,   ///< a derivative does not exist: a kink, the axis of a surface of revolution
  ZeroGradient  ///< or lost in rounding: a cone's apex
};
std::string_view nameOf(PointStatus status);

/// The gradient counts as zero when |gradient| / |Hessian|, the distance at which it would vanish,
/// is below this part of the domain's diameter (ours).
inline constexpr double kZeroGradient = 1e-12;

double valueAt(const Surface& surface, const Point& world);
/// All g can be in a box of local space.
Interval valueIn(const Surface& surface, const Domain& local);
/// g and its derivatives by world coordinates. Only what is `Smooth` may be used.
PointStatus derivativesAt(const Surface& surface, const Point& world, Jet3<double>& out);
/// The seeds with which a tape gives derivatives by world coordinates, of any scalar.
template <class S>
std::array<Jet3<S>, 3> seedsAt(const Affine& localFromWorld, const std::array<S, 3>& world) {
  std::array<Jet3<S>, 3> seeds;
  for (int row = 0; row < 3; ++row) {
    S v(localFromWorld.offset[row]);
    for (int column = 0; column < 3; ++column) {
      const S m(localFromWorld.linear[column][row]);
      v += m * world[static_cast<std::size_t>(column)];
      seeds[static_cast<std::size_t>(row)].c[static_cast<std::size_t>(column) + 1] = m;
    }
    seeds[static_cast<std::size_t>(row)].c[0] = v;
  }
  return seeds;
}

/// A world-space box around the surface inside its domain: cells of a 32^3 grid where interval
/// arithmetic cannot rule it out. Empty: proven that there is no surface.
Domain boundsOf(const Surface& surface);

// ---- Rays ----
struct SurfaceRay {
  Point origin;
  Point direction;  ///< any length but 0
  double tMin = 0.0;
  double tMax = std::numeric_limits<double>::infinity();
};

enum class HitStatus {
  Miss,
  Hit,
  Unresolved  ///< given up after kMaxRayBoxes: g stays near 0 along the ray (or is 0 everywhere)
};
struct SurfaceHit {
  HitStatus status = HitStatus::Miss;
  double t = 0.0;        ///< of the first crossing
  bool grazing = false;  ///< before it (or in vain) the ray came too near to tell a touch from none
};

/// Two crossings nearer to each other than this part of the ray inside the domain may be missed
/// together (ours).
inline constexpr double kRayResolution = 1e-9;
/// Pieces of one ray that are looked at (ours).
inline constexpr int kMaxRayBoxes = 20'000;

/// The first crossing with tMin <= t <= tMax inside the domain.
/// Guarantee: pieces of the ray are discarded only when interval arithmetic proves that g has no
/// zero there, and taken to hold exactly one when it proves g' free of zeros; for polynomials the
/// signs of Bernstein's coefficients prove the same (RayPolynomial). So no crossing at
/// which g changes sign is missed, unless another lies within kRayResolution of it. A zero without
/// a change of sign (a touch) is no crossing. t is as exact as g's rounding allows. Poles and jumps
/// of g are no crossings. Quadrics use the closed form, with the same meaning.
SurfaceHit firstHit(const Surface& surface, const SurfaceRay& ray);
/// All of them in order, with the same guarantee; `status` as above.
std::vector<double> allHits(const Surface& surface, const SurfaceRay& ray, HitStatus& status);

}  // namespace catoptric::implicit
