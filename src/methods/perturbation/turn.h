// A vertex of a path: a reflection, or a refraction.
#pragma once

#include <cstddef>
#include <span>

#include "core/math.h"
#include "methods/perturbation/vector.h"
#include "scene/implicit/jet.h"
#include "scene/implicit/surface.h"

namespace catoptric::methods::perturbation {

/// A reflector of a sequence, or a surface through which a path is refracted.
struct Turn {
  const implicit::Surface* surface = nullptr;
  Box3 bounds;               ///< box around the surface, world space
  bool through = false;      ///< refracts
  double indexBefore = 1.0;  ///< index of refraction on the side of the eye
  double indexAfter = 1.0;
  bool inside = false;  ///< whether the path is inside a refractive object before the turn
  /// Points of the surface, from which its small images in the preceding reflectors are found. If
  /// empty, such images may be missed.
  std::span<const Vec3> points = {};
  /// Whether this is a total reflection inside a refractive object.
  bool total() const { return !through && inside; }
};
/// Maximum number of turns of a path (run config: bounces).
inline constexpr std::size_t kMaxTurns = 6;

/// A reflector reflects itself only at distances above this fraction of its size (not from the
/// paper).
inline constexpr double kOffSurface = 1e-3;

inline Vector<double> vectorOf(const glm::dvec3& p) {
  return {{p.x, p.y, p.z}};
}
inline glm::dvec3 pointOf(const Vector<double>& v) {
  return {v[0], v[1], v[2]};
}
inline glm::dvec3 gradientOf(const Jet3<double>& g) {
  return {g.gradient(0), g.gradient(1), g.gradient(2)};
}

/// The direction after a turn for light along `direction` (unit length); zero if a surface that
/// should transmit it reflects it totally.
inline glm::dvec3 onwards(const Turn& turn, const glm::dvec3& direction, const glm::dvec3& normal) {
  if (!turn.through) return glm::reflect(direction, normal);
  const glm::dvec3 against = glm::dot(normal, direction) > 0.0 ? -normal : normal;
  return glm::refract(direction, against, turn.indexBefore / turn.indexAfter);
}

}  // namespace catoptric::methods::perturbation
