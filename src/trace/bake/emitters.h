// Surfaces that emit light, and the sampling of points on them.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/math.h"
#include "frame/geometry.h"
#include "scene/scene.h"

namespace catoptric::trace {

inline float luminance(const Vec3& c) {
  return 0.2126f * c.x + 0.7152f * c.y + 0.0722f * c.z;
}

/// Emissive triangles of the objects that cast light, with a distribution to sample them.
struct Emitters {
  struct Triangle {
    std::array<Vec3, 3> corners;
    Vec3 normal{0.0f};
    Vec3 radiance{0.0f};
  };
  std::vector<Triangle> triangles;
  std::vector<float>
      cumulative;      ///< cumulative distribution of luminance times area, normalized to 1
  double total = 0.0;  ///< sum of luminance times area
  /// Index in `triangles` of the first triangle of each object; -1 if the object emits nothing.
  std::vector<std::int64_t> firstOfObject;

  /// Probability density of the points of a triangle, with respect to area, 1/m^2.
  float density(const Triangle& t) const {
    return static_cast<float>(static_cast<double>(luminance(t.radiance)) / total);
  }
};

Emitters findEmitters(const scene::Scene& scene, const frame::Geometry& geometry);

/// The texture's colour at a vertex, from the mip level of at most 8 x 8 texels.
Vec3 coarseTexel(const scene::Scene& scene, const scene::TextureSlot& slot,
                 const frame::VertexAttributes& vertex);

}  // namespace catoptric::trace
