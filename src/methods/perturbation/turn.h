// One turn of a path: a reflection, or the passage of a surface that refracts.
#pragma once

#include <cstddef>
#include <span>

#include "core/math.h"
#include "methods/perturbation/vector.h"
#include "scene/implicit/jet.h"
#include "scene/implicit/surface.h"

namespace catoptric::methods::perturbation {

/// One reflector of a sequence, or a passage of a surface that refracts.
struct Turn {
  const implicit::Surface* surface = nullptr;
  Box3 bounds;               ///< of the surface, world space
  bool through = false;      ///< refracts
  double indexBefore = 1.0;  ///< of refraction, on the side of the eye
  double indexAfter = 1.0;
  bool inside = false;  ///< of a body that refracts, before the turn
  /// Points of the surface, by which its small images in the reflectors before are found; none:
  /// those may be missed.
  std::span<const Vec3> points = {};
  /// Reflects inside a body that refracts, where it lets nothing out.
  bool total() const { return !through && inside; }
};
/// Reflectors of one path, at most (run config: bounces).
inline constexpr std::size_t kMaxTurns = 6;

/// Nearer than this part of its size a reflector does not show itself (ours).
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

/// Where light along `direction`, of unit length, goes at a turn; zero where a surface that should
/// let it out reflects it totally.
inline glm::dvec3 onwards(const Turn& turn, const glm::dvec3& direction, const glm::dvec3& normal) {
  if (!turn.through) return glm::reflect(direction, normal);
  const glm::dvec3 against = glm::dot(normal, direction) > 0.0 ? -normal : normal;
  return glm::refract(direction, against, turn.indexBefore / turn.indexAfter);
}

}  // namespace catoptric::methods::perturbation
