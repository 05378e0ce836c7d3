// Implicit surfaces g(x, y, z) = 0: a catalogue, and any formula. One definition yields values,
// exact derivatives up to order 3 (jets), bounds, and ray intersections with a stated guarantee.
// All in double. A surface is defined in local space, in which its domain is an axis-aligned box,
// and placed by an affine map. The functions below take and return world-space points.
#pragma once

#include <array>
#include <optional>
#include <string_view>
#include <vector>

#include "core/math.h"
#include "scene/implicit/evaluate.h"

namespace catoptric::implicit {

using Point = glm::dvec3;

/// Axis-aligned box, boundary included; empty if min > max.
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

/// coefficients of xx, yy, zz, xy, xz, yz, x, y, z, 1
using QuadricCoefficients = std::array<double, 10>;

struct Surface {
  Tape tape;              ///< g, in local coordinates
  Domain domain;          ///< the surface is cut off at its boundary (local space)
  Affine localFromWorld;  ///< invertible
  std::optional<QuadricCoefficients>
      quadric;  ///< the same g as a quadric, whose ray intersections have a closed form
};

// ---- Catalogue (local space, y up). Throws SceneError for sizes that are not positive and finite.
/// dot(normal, x) = offset, cut off by `domain`.
Surface planeSurface(const Point& normal, double offset, const Domain& domain);
Surface sphereSurface(double radius);
Surface ellipsoidSurface(const Point& radii);
/// About the y axis, open at both ends.
Surface cylinderSurface(double radius, double height);
/// Apex at the origin; opens downwards to `radius` at y = -height, without a base.
Surface coneSurface(double radius, double height);
/// About the y axis. `radius`: of the tube's centre line; `tube`: of the tube.
Surface torusSurface(double radius, double tube);
Surface quadricSurface(const QuadricCoefficients& coefficients, const Domain& domain);
/// (|x/a|^(2/e) + |z/c|^(2/e))^(e/n) + |y/b|^(2/n) = 1. e is the roundness about the y axis, n
/// along it, both in 0.1 .. 4. [Barr1981]
Surface superquadricSurface(const Point& radii, double e, double n);
/// sum exp(sharpness (1 - |x - centre|^2 / radius^2)) = 1 [Blinn1982]; w is a ball's radius. A
/// single ball is a sphere of this radius.
Surface metaballsSurface(const std::vector<glm::dvec4>& balls, double sharpness);
/// sqrt(x^2 + z^2) = sum c_i y^i, between two heights.
Surface revolutionSurface(const std::vector<double>& coefficients, double yMin, double yMax);
/// The vase of [Chen2000] Sec. IV, with its axis along y and height 2.
Surface vaseSurface();
/// A surface of any formula that `parseFormula` reads.
Surface formulaSurface(std::string_view formula, const std::vector<Parameter>& parameters,
                       const Domain& domain, std::string_view what = "formula");

/// The surface moved by the map x -> linear * x + offset, after its present placement. Throws
/// SceneError if the map cannot be inverted.
Surface placed(Surface surface, const glm::dmat3& linear, const Point& offset);

// ---- Values ----
enum class PointStatus {
  Smooth,
  NotFinite,    ///< g is NaN or infinite
  NoGradient,   ///< a derivative does not exist: at a kink, or on the axis of a surface of
                ///< revolution
  ZeroGradient  ///< zero, or lost in rounding: at a cone's apex
};
std::string_view nameOf(PointStatus status);

/// The gradient counts as zero if |gradient| / |Hessian|, the distance at which it would vanish, is
/// below this fraction of the domain's diameter (our choice).
inline constexpr double kZeroGradient = 1e-12;

double valueAt(const Surface& surface, const Point& world);
/// Bounds of g over a box in local space.
Interval valueIn(const Surface& surface, const Domain& local);
/// g and its derivatives with respect to world coordinates. `out` is valid only if the result is
/// `Smooth`.
PointStatus derivativesAt(const Surface& surface, const Point& world, Jet3<double>& out);
/// The seeds with which a tape yields derivatives with respect to world coordinates, for any
/// scalar.
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

/// A world-space box around the surface inside its domain. It contains the cells of a 32^3 grid in
/// which interval arithmetic cannot exclude the surface. Empty: there is provably no surface.
Domain boundsOf(const Surface& surface);

// ---- Rays ----
struct SurfaceRay {
  Point origin;
  Point direction;  ///< of any length except 0
  double tMin = 0.0;
  double tMax = std::numeric_limits<double>::infinity();
};

enum class HitStatus {
  Miss,
  Hit,
  Unresolved  ///< given up after kMaxRayBoxes, because g stays near 0 along the ray (or is 0
              ///< everywhere)
};
struct SurfaceHit {
  HitStatus status = HitStatus::Miss;
  double t = 0.0;        ///< of the first crossing
  bool grazing = false;  ///< before the hit (or without a hit) the ray came so near that a touch
                         ///< cannot be excluded
};

/// Two crossings may be missed together if they are closer to each other than this fraction of the
/// ray inside the domain (our choice).
inline constexpr double kRayResolution = 1e-9;
/// Largest number of pieces of a ray that are examined (our choice).
inline constexpr int kMaxRayBoxes = 20'000;

/// The first crossing with tMin <= t <= tMax inside the domain, where a crossing is a zero of g at
/// which g changes sign.
///
/// Guarantee: no crossing is missed unless another one lies within kRayResolution of it. A piece of
/// the ray is discarded only if interval arithmetic proves that g has no zero there. It counts as
/// containing exactly one zero only if interval arithmetic proves that g' has none. For polynomials
/// the signs of the Bernstein coefficients prove the same (RayPolynomial).
///
/// Zeros without a change of sign (a touch), poles and jumps of g are no crossings. t is as exact
/// as the rounding of g allows. Quadrics use the closed form, with the same meaning.
SurfaceHit firstHit(const Surface& surface, const SurfaceRay& ray);
/// All crossings in order, with the same guarantee; `status` as in firstHit().
std::vector<double> allHits(const Surface& surface, const SurfaceRay& ray, HitStatus& status);

}  // namespace catoptric::implicit
