// The one shading model, evaluated by GL (raster/shaders/shading.glsl, the same formulas in the
// same order) and on the CPU for traced rays:
//   L = albedo / pi * (bake.rgb + visibility * (E_sh(n) + pi * ambient) + sum_i E_i(x, n)) +
//   emissive
// where E_sh is the spherical-harmonics irradiance of the environment (order 2), visibility is
// the baked ambient occlusion, and E_i the irradiance of the lights that are not baked. (After a
// full bake visibility is 0: bake.rgb holds environment and ambient too.)
//
// The agreement, in this order; all of a vertex's attributes are interpolated linearly:
//   N   = normalize(normal), d = direction from the eye to the point, unit length.
//         frame::Geometry winds triangles so that their geometric normal lies on the side of their
//         vertex normals: gl_FrontFacing and dot(geometric normal, d) < 0 say the same.
//   uv' = slot.transform * (uv of the slot's set, 1)
//   lod = log2(max(1e-8, uvPerMetre * textureScale(slot) * coneWidth / sqrt(max(|N.d|, 0.05)))),
//         clamped to the chain; trilinear; texels decoded from sRGB before filtering. Nearest
//         textures: the texel of level 0.
//   n   = N; with a normal map t = normalize(tangent.xyz), b = cross(N, t) * tangent.w,
//         m = 2 texel - 1, m.xy *= normalScale, n = normalize(m.x t + m.y b + m.z N).
//         n = -n when the viewer sees the back of the triangle.
//         Where s > 0 and bendsNormals(), the normal of the reflection (and of it alone) is bent
//         by aboveSurface(): interpolated and mapped normals can mirror rays into the surface.
//   albedo = baseColor * texel * vertex colour; unlit: L = albedo and nothing else.
//   s, g: the material's; with a metallic-roughness texture g = roughnessFactor * texel.g (g is the
//         roughness of a Phong or a GGX lobe, by Material::lobe),
//         s = specularLevel(metallicFactor * texel.b, dielectricF0), 0 below kReflectiveThreshold.
//   Tint of the reflection, which is seen as s * tint * radiance: reflectionTint + albedoTint *
//   albedo;
//         with a metallic-roughness texture and albedoTint > 0 by scene::tintShares() of the
//         texel: s * tint is glTF's F0, mix(dielectricF0, albedo, metallic).
//   Highlights (Lighting::highlights, where s > 0 and the lobe is no mirror): sum_i E_i(x, l) p(l),
//         seen as the reflection is, s * tint times; l towards the light, E_i(x, l) its irradiance
//         across that, p the density of trace::lobeDirection()'s rays about r, d mirrored at the
//         normal n of the reflection: p(l) = lobe(l) + lobe(l - 2 (l.h) h) where l.h > 0, else 0,
//         h being n, or the triangle's normal where n may be bent (SurfacePoint::lobeHorizon);
//         lobe(l) = (k + 1) / (2 pi) (r.l)^k, k = phongExponentFromGlossiness(g). Of GGX p(l) =
//         D G2 / (4 n.v) (scene::ggxResponse). So a light of some size that shrinks comes to the
//         same. Unshadowed, as E_i is.
//   E_sh(n) = max(0, sum_k c_k Y_k(n)); Y_0..8 = 0.282095, 0.488603 (y, z, x),
//         1.092548 (xy, yz), 0.315392 (3 z^2 - 1), 1.092548 xz, 0.546274 (x^2 - y^2).
//   E_i: directional intensity * max(0, n.l); point and spot with r = |x_i - x|:
//         intensity * max(0, n.l) / max(r^2, 1e-12) * clamp(1 - (r / range)^4, 0, 1) (no such
//         factor for range 0) * clamp((cos - cosOuter) / max(1e-3, cosInner - cosOuter), 0, 1)^2
//         (spot only; KHR_lights_punctual); at most 1e30.
//   Environment radiance (all times scale): constant color; gradient mix(horizon, y >= 0 ? color :
//         ground, |y|) with y of the unit direction; file: d turned by -rotation about +y, pixel
//         position u = 0.5 + atan2(x, -z) / (2 pi), v = acos(y) / pi, bilinear, u repeats, v
//         clamps.
//   Alpha masks: cut away where baseAlpha * base colour texel's alpha at level 0 < alphaCutoff.
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
  bool operator==(const WorldLight&) const = default;
};

/// Radiance of the environment by direction: constant, gradient, or a latitude-longitude image.
class EnvironmentLight {
 public:
  explicit EnvironmentLight(const scene::Environment& environment);
  Vec3 radiance(const Vec3& direction) const;  ///< unit direction, world space
  /// Where the image shows a unit direction of world space: u and v in 0..1, v from the top.
  Vec2 imageUv(const Vec3& direction) const;
  /// Irradiance coefficients of the nine spherical harmonics of order <= 2, premultiplied so that
  /// E(n) = sum c_k Y_k(n) [Ramamoorthi2001].
  const std::array<Vec3, 9>& irradianceSh() const { return irradianceSh_; }
  Vec3 irradiance(const Vec3& normal) const;
  /// The image as RGB floats for upload, as the file has them (scale and rotation are applied at
  /// look-up); empty (0 x 0) for constant and gradient.
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
  std::array<Vec4, 9> ofFour_{};  ///< the same with a 0 after each
};

/// All that shading needs of a scene at one moment, beside the geometry.
struct Lighting {
  std::shared_ptr<const EnvironmentLight> environment;
  Vec3 ambient{0.0f};
  std::vector<WorldLight> lights;  ///< those that are not baked
  bool highlights = false;         ///< of those lights on glossy surfaces
  bool operator==(const Lighting&) const = default;
};
/// Lights that are marked as baked are left out only where a full bake holds them.
Lighting makeLighting(const scene::Scene& scene, const scene::Pose& pose,
                      std::shared_ptr<const EnvironmentLight> environment);

bool hasUnbakedLights(const scene::Scene& scene);

/// One light at a pose.
WorldLight worldLight(const scene::Light& light, const scene::Pose& pose);

/// Irradiance E_i of the formula above, without shadows; `normal` of unit length.
Vec3 lightIrradiance(const WorldLight& light, const Vec3& position, const Vec3& normal);

/// Radiance of the lights' highlights by the formula above: `normal` of the reflection, `direction`
/// from the viewer, of unit length, as `lobeHorizon`.
Vec3 lightHighlights(const std::vector<WorldLight>& lights, const Vec3& position,
                     const Vec3& normal, const Vec3& lobeHorizon, const Vec3& direction,
                     scene::Lobe lobe);

/// A point on a surface as a ray or a pixel sees it.
struct SurfacePoint {
  Vec3 position{0.0f};
  Vec3 normal{0.0f, 1.0f, 0.0f};  ///< shading normal, normal map applied, turned to the viewer
  Vec3 geometricNormal{0.0f, 1.0f, 0.0f};
  Vec3 diffuse{0.0f};          ///< radiance L of the formula above
  float specularLevel = 0.0f;  ///< s
  scene::Lobe lobe;
  Vec3 tint{1.0f};       ///< trace::reflectionWeights() of s and it
  Vec3 highlight{0.0f};  ///< of the lights
  int object = 0;        ///< id
  bool bent = false;     ///< the normal is aboveSurface()'s
  /// Normal of the plane that rays of its lobe stay above: of a lobe whose normal may have to be
  /// bent (bendsNormals()) geometricNormal, else `normal`.
  Vec3 lobeHorizon{0.0f, 1.0f, 0.0f};
};

/// A mirrored ray leaves with at least this elevation above the triangle, as a sine, but no more
/// than this share of the viewer's own: as Cycles' ensure_valid_specular_reflection().
inline constexpr float kLeastElevation = 0.025f;
inline constexpr float kElevationShare = 0.9f;

/// Whether normals of an object's reflective places may have to be bent: no plane, no body that
/// refracts, no implicit surface, whose normals are those of its places; but with a normal map.
bool bendsNormals(const scene::Scene& scene, const ObjectRange& range, int object);

/// Bends `normal` towards `geometric` as far as the ray that it mirrors needs to leave above the
/// surface, and says whether that was needed. All of unit length; `geometric` turned to the viewer,
/// from whom `direction` comes. In the plane of both normals, n = X sin a + G cos a mirrors the way
/// to the viewer to the elevation v.X sin 2a + v.G cos 2a, which is solved for the largest a.
bool aboveSurface(const Vec3& geometric, const Vec3& direction, Vec3& normal);

/// The tint of a material's reflection where its metallic and albedo are these.
Vec3 reflectionTint(const scene::Material& material, float metallic, const Vec3& albedo);

/// Evaluates the surface at barycentric (u, v) of triangle `primitive` of object index `object`;
/// where the object has an implicit surface, N and the side are those of its gradient at
/// `position`. Seen along `direction` with a ray cone of `coneWidth` metres there (mip level,
/// [Akenine2019] as shading.glsl has it).
SurfacePoint shadeSurface(const scene::Scene& scene, const Geometry& geometry,
                          const Lighting& lighting, int object, std::uint32_t primitive, float u,
                          float v, const Vec3& position, const Vec3& direction, float coneWidth);

/// True where the alpha mask cuts the surface away: such hits do not count, for any ray.
bool isCutOut(const scene::Scene& scene, const Geometry& geometry, int object,
              std::uint32_t primitive, float u, float v);

/// Texels of the base level per unit of the untransformed uv of a slot: max(width, height) times
/// the root of the transform's area scale; what lod above multiplies uvPerMetre with.
float textureScale(const scene::Scene& scene, const scene::TextureSlot& slot);

/// Trilinear sample, the CPU's twin of textureLod(): linear values.
Vec4 sampleTexture(const scene::Texture& texture, Vec2 uv, float lod);

}  // namespace catoptric::frame
