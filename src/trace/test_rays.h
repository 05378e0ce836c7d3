// Random rays for tests.
#pragma once

#include <random>

#include "core/math.h"

namespace catoptric {

/// A unit vector, uniformly distributed over the sphere.
inline Vec3 randomDirection(std::mt19937& random) {
  std::normal_distribution<float> normal;
  Vec3 d(0.0f);
  while (!(glm::length(d) > 1e-3f)) d = Vec3(normal(random), normal(random), normal(random));
  return glm::normalize(d);
}

}  // namespace catoptric
