// The one shading model, evaluated by GL (raster/shaders/shading.glsl, the same formulas in the
// same order) and on the CPU for traced rays:
//   L = albedo / pi * (bake.rgb + visibility * (E_sh(n) + pi * ambient) + sum_i E_i(x, n)) +
//   emissive
// where E_sh is the spherical-harmonics irradiance of the environment (order 2), visibility is
// the baked ambient occlusion, and E_i the irradiance of the lights that are not baked.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "core/math.h"
#include "frame/geometry.h"
#include "scene/scene.h"

namespace catoptric::frame {

/// A light in world space at one moment.
struct WorldLight {
  scene::LightType type = scene::LightType::Point;
  Vec3 position{0.0f};
  Vec3 direction{0.0f, -1.0f, 0.0f};  ///< where it shines to, unit length
  Vec3 intensity{0.0f};
  float range = 0.0f;
  float cosInner = 1.0f;
  float cosOuter = 0.0f;
};

/// Radiance of the environment by direction: constant, gradient, or a latitude-longitude image.
class EnvironmentLight {
 public:
  explicit EnvironmentLight(const scene::Environment& environment);
  Vec3 radiance(const Vec3& direction) const;  ///< unit direction, world space
  /// Irradiance coefficients of the nine spherical harmonics of order <= 2, premultiplied so that
  /// E(n) = sum c_k Y_k(n) [Ramamoorthi2001].
  const std::array<Vec3, 9>& irradianceSh() const { return irradianceSh_; }
  Vec3 irradiance(const Vec3& normal) const;
  /// The image as RGB floats for upload; empty (0 x 0) for constant and gradient.
  const std::vector<Vec3>& pixels() const { return pixels_; }
  int width() const { return width_; }
  int height() const { return height_; }
  const scene::Environment& description() const { return description_; }

 private:
  scene::Environment description_;
  std::vector<Vec3> pixels_;
  int width_ = 0;
  int height_ = 0;
  std::array<Vec3, 9> irradianceSh_{};
};

/// All that shading needs of a scene at one moment, beside the geometry.
struct Lighting {
  std::shared_ptr<const EnvironmentLight> environment;
  Vec3 ambient{0.0f};
  std::vector<WorldLight> lights;  ///< those that are not baked
};
Lighting makeLighting(const scene::Scene& scene, const scene::Pose& pose,
                      std::shared_ptr<const EnvironmentLight> environment);

/// A point on a surface as a ray or a pixel sees it.
struct SurfacePoint {
  Vec3 position{0.0f};
  Vec3 normal{0.0f, 1.0f, 0.0f};  ///< shading normal, normal map applied, turned to the viewer
  Vec3 geometricNormal{0.0f, 1.0f, 0.0f};
  Vec3 diffuse{0.0f};          ///< radiance L of the formula above
  float specularLevel = 0.0f;  ///< s
  float glossiness = 0.0f;     ///< g
  int object = 0;              ///< id
};

/// Evaluates the surface at barycentric (u, v) of triangle `primitive` of object index `object`,
/// seen along `direction` with a ray cone of `coneWidth` metres there (mip level, [Akenine2019]
/// as shading.glsl has it).
SurfacePoint shadeSurface(const scene::Scene& scene, const Geometry& geometry,
                          const Lighting& lighting, int object, std::uint32_t primitive, float u,
                          float v, const Vec3& position, const Vec3& direction, float coneWidth);

/// True where the alpha mask cuts the surface away: such hits do not count, for any ray.
bool isCutOut(const scene::Scene& scene, const Geometry& geometry, int object,
              std::uint32_t primitive, float u, float v);

/// Trilinear sample, the CPU's twin of textureLod(): linear values.
Vec4 sampleTexture(const scene::Texture& texture, Vec2 uv, float lod);

}  // namespace catoptric::frame
