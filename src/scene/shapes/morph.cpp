// Morph targets: each target is a displacement of the rest shape, its normals those of the fully
// displaced shape.
#include <algorithm>
#include <cmath>

#include "scene/shapes/shapes.h"

namespace catoptric::scene {
namespace {

int targetCount(MorphType type) {
  return type == MorphType::Wave || type == MorphType::Flag ? 2 : 1;
}

/// The longest axis of the bounds that is not the morph's own.
int waveAxis(const Box3& bounds, const Vec3& axis) {
  const Vec3 size = (bounds.max - bounds.min) * (Vec3(1.0f) - glm::abs(axis));
  return size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
}

}  // namespace

Vec3 morphedPosition(const MorphShape& shape, const Box3& bounds, int target,
                     const Vec3& position) {
  const Vec3 size = glm::max(bounds.max - bounds.min, Vec3(1e-6f));
  const Vec3 unit = (position - bounds.min) / size;
  const Vec3 centred = position - bounds.centre();
  switch (shape.type) {
    case MorphType::Wave:
    case MorphType::Flag: {
      // sin(k x - w t) = sin(k x) cos(w t) - cos(k x) sin(w t): two targets make it travel.
      const int along = waveAxis(bounds, shape.axis);
      const float phase = 2.0f * kPi * shape.waves * unit[along];
      const float hold = shape.type == MorphType::Flag ? unit[along] : 1.0f;  // fixed at the pole
      const float wave = target == 0 ? std::sin(phase) : std::cos(phase);
      return position + shape.axis * (shape.amplitude * hold * wave);
    }
    case MorphType::Bulge: {
      // Spherical ripples of a body: along the direction from the centre.
      const Vec3 direction = normalizedOr(centred, shape.axis);
      const float ripple = std::cos(shape.waves * kPi * glm::dot(direction, shape.axis));
      return position + direction * (shape.amplitude * ripple);
    }
    case MorphType::Twist: {
      // Turns about the axis, in proportion to the height along it.
      const float height = glm::dot(centred, shape.axis) / glm::dot(size, glm::abs(shape.axis));
      const Quat turn = glm::angleAxis(2.0f * kPi * shape.amplitude * height, shape.axis);
      return bounds.centre() + turn * centred;
    }
    case MorphType::Stretch: {
      const float along = glm::dot(centred, shape.axis);
      const Vec3 across = centred - along * shape.axis;
      const float factor = 1.0f + shape.amplitude;
      return bounds.centre() + along * factor * shape.axis + across / std::sqrt(factor);
    }
  }
  return position;
}

int addMorphTargets(Mesh& mesh, const MorphShape& shape) {
  Box3 bounds;
  for (const Vec3& p : mesh.positions) bounds.extend(p);
  const float step = 1e-3f * std::max(bounds.diameter(), 1e-6f);
  const int targets = targetCount(shape.type);
  for (int target = 0; target < targets; ++target) {
    MorphTarget morph;
    for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
      const Vec3& p = mesh.positions[v];
      const auto at = [&](const Vec3& q) { return morphedPosition(shape, bounds, target, q); };
      morph.positions.push_back(at(p) - p);
      // Normals transform by the cofactors of the deformation's Jacobian (central differences).
      Mat3 jacobian;
      for (int a = 0; a < 3; ++a) {
        Vec3 offset(0.0f);
        offset[a] = step;
        jacobian[a] = (at(p + offset) - at(p - offset)) / (2.0f * step);
      }
      const Mat3 cofactors(glm::cross(jacobian[1], jacobian[2]),
                           glm::cross(jacobian[2], jacobian[0]),
                           glm::cross(jacobian[0], jacobian[1]));
      morph.normals.push_back(normalizedOr(cofactors * mesh.normals[v], mesh.normals[v]) -
                              mesh.normals[v]);
    }
    mesh.morphTargets.push_back(std::move(morph));
  }
  return targets;
}

}  // namespace catoptric::scene
