// Surfaces of every kind, for tests of several modules.
#pragma once

#include <string>
#include <vector>

#include "scene/implicit/surface.h"

namespace catoptric::test {

inline const implicit::Domain kBox{{-2, -2, -2}, {2, 2, 2}};

struct NamedSurface {
  std::string name;
  implicit::Surface surface;
};

/// All shapes that have parameters of their own; callers add vases and formulas.
inline std::vector<NamedSurface> namedSurfaces() {
  using namespace implicit;
  return {
      {"plane", planeSurface({1, 2, -0.5}, 0.3, kBox)},
      {"sphere", sphereSurface(1.2)},
      {"ellipsoid", ellipsoidSurface({1.0, 0.7, 1.4})},
      {"cylinder", cylinderSurface(0.8, 2.0)},
      {"cone", coneSurface(0.9, 1.5)},
      {"torus", torusSurface(1.0, 0.4)},
      {"quadric", quadricSurface({1, -0.5, 0.7, 0.2, -0.3, 0.4, 0.1, -0.2, 0.3, -0.6}, kBox)},
      {"superquadric", superquadricSurface({1.0, 0.8, 1.1}, 0.6, 0.45)},
      {"metaballs",
       metaballsSurface({{0, 0, 0, 0.7}, {0.8, 0.2, 0, 0.5}, {0.1, 0.9, 0.3, 0.4}}, 2.0)},
      {"revolution", revolutionSurface({0.6, 0.3, -0.5, 0.2}, -1.0, 1.0)},
  };
}

}  // namespace catoptric::test
