// Rays stored by component, as vector code produces and reads them.
#pragma once

#include <cstddef>

#include "core/math.h"

namespace catoptric::trace {

/// Rays that extend from 0 to infinity. The arrays must be readable up to the next multiple of 16.
struct RayLanes {
  const float* originX;
  const float* originY;
  const float* originZ;
  const float* directionX;
  const float* directionY;
  const float* directionZ;

  Vec3 origin(std::size_t i) const { return {originX[i], originY[i], originZ[i]}; }
  Vec3 direction(std::size_t i) const { return {directionX[i], directionY[i], directionZ[i]}; }
};

}  // namespace catoptric::trace
