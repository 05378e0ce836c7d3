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

/// The triangles that rays are aimed at: emissive ones, and those that reflect far more than the
/// mean, such as patches of sun and the insides of lamp shades. With a distribution to sample them.
struct Emitters {
  struct Triangle {
    std::array<Vec3, 3> corners;
    std::array<Vec3, 3> radiance;  ///< at the corners, emitted and reflected
    Vec3 normal{0.0f};
    float area = 0.0f;  ///< m^2

    Vec3 radianceAt(float u, float v) const {
      return (1.0f - u - v) * radiance[0] + u * radiance[1] + v * radiance[2];
    }
    float meanLuminance() const { return luminance(radianceAt(1.0f / 3.0f, 1.0f / 3.0f)); }
    double power() const { return static_cast<double>(meanLuminance() * area); }
  };
  std::vector<Triangle> triangles;
  std::vector<double> cumulative;  ///< cumulative distribution of power(), normalized to 1
  double total = 0.0;              ///< sum of power()
  double share = 0.0;              ///< `total` as a fraction of that of all surfaces
  /// Index in `triangles` of each triangle of the geometry; -1: not among them.
  std::vector<std::int32_t> ofTriangle;

  /// Probability density of the points of a triangle, with respect to area, 1/m^2.
  float density(const Triangle& t) const {
    return static_cast<float>(static_cast<double>(t.meanLuminance()) / total);
  }

  struct Pick {
    const Triangle& triangle;
    float within;  ///< where `choice` lies in the triangle's interval, 0..1
  };
  /// The triangle in whose interval of the distribution `choice` lies. 0 <= choice < 1.
  Pick pick(double choice) const;
};

/// `leaving`: the radiance that surfaces reflect, per vertex.
Emitters findEmitters(const scene::Scene& scene, const frame::Geometry& geometry,
                      const std::vector<Vec3>& leaving);

/// The texture's colour at a vertex, from the mip level of at most 8 x 8 texels.
Vec3 coarseTexel(const scene::Scene& scene, const scene::TextureSlot& slot,
                 const frame::VertexAttributes& vertex);

}  // namespace catoptric::trace
