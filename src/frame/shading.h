// The one shading model. GL (raster/shaders/shading.glsl, the same formulas in the same order) and
// the CPU (for traced rays) both implement it:
//   L = albedo / pi * (bake.rgb + visibility * (E_sh(n) + pi * ambient) + sum_i E_i(x, n)) +
//   emissive
// where E_sh is the spherical-harmonics irradiance of the environment (order 2), visibility is
// the baked ambient occlusion, and E_i the irradiance of the lights that are not baked. (After a
// full bake visibility is 0: bake.rgb then contains environment and ambient light too.)
//
// Conventions, in the order of evaluation. All attributes of a vertex are interpolated linearly.
//   N   = normalize(normal), d = direction from the eye to the point, unit length.
//         frame::Geometry winds triangles so that their geometric normal lies on the side of their
//         vertex normals: gl_FrontFacing and dot(geometric normal, d) < 0 are equivalent.
//   uv' = slot.transform * (uv of the slot's set, 1)
//   lod = log2(max(1e-8, uvPerMetre * textureScale(slot) * coneWidth / sqrt(max(|N.d|, 0.05)))),
//         clamped to the chain; trilinear; texels decoded from sRGB before filtering. Nearest
//         textures: the texel of level 0.
//   n   = N; with a normal map t = normalize(tangent.xyz), b = cross(N, t) * tangent.w,
//         m = 2 texel - 1, m.xy *= normalScale, n = normalize(m.x t + m.y b + m.z N).
//         n = -n when the viewer sees the back of the triangle.
//         Where s > 0, the normal of the reflection (and only that one) is not the mean normal of
//         level lod, but one of the normals that lod averages. It is read from level lod -
//         kFinerLevels, at uv' + (scatter - 0.5) (2^lod - 1) / (size of level 0).
//         DEVIATION: [Toksvig2005] widens the lobe by the variance of these normals. A mirror would
//         then need many rays, and on a tiled wall the joints would blur the flat tiles.
//         Where s > 0 and bendsNormals(), aboveSurface() corrects the normal of the reflection (and
//         only that one): interpolated and mapped normals can mirror rays into the surface.
//   albedo = baseColor * texel * vertex colour; unlit: L = albedo.
//   s, g: the material's; with a metallic-roughness texture g = roughnessFactor * texel.g (the
//         roughness of the lobe Material::lobe) and s = specularLevel(metallicFactor * texel.b,
//         dielectricF0). Of a Phong lobe s is 0 below kReflectiveThreshold.
//   Tint: the reflection adds s * tint * radiance; tint = reflectionTint + albedoTint * albedo.
//         With a metallic-roughness texture and albedoTint > 0, scene::tintShares() of the texel
//         gives the tint: s * tint is glTF's F0, mix(dielectricF0, albedo, metallic).
//   F90: scene::rimLevel(metallic, dielectricF90). A GGX lobe reflects mix(s * tint, F90, p), and
//         the diffuse radiance has the weight mix(1 - s, 1 - F90, p), p = scene::meanSchlick().
//   Highlights (Lighting::highlights, s > 0, lobe not a mirror): sum_i E_i(x, l) p(l), multiplied
//         by s * tint like the reflection. l points to the light, E_i(x, l) is the irradiance
//         perpendicular to l. p is the density of trace::lobeDirection()'s rays about r, the
//         direction d mirrored at the normal n of the reflection. For Phong:
//         p(l) = lobe(l) + lobe(l - 2 (l.h) h) where l.h > 0, else 0;
//         h = n, or the triangle's normal where n may be corrected (SurfacePoint::lobeHorizon);
//         lobe(l) = (k + 1) / (2 pi) (r.l)^k, k = phongExponentFromRoughness(g).
//         For GGX: p(l) = D G2 / (4 n.v) (scene::ggxResponse). This is the limit of a shrinking
//         area light. Unshadowed, like E_i.
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

/// A light in world space at one time.
struct WorldLight {
  scene::LightType type = scene::LightType::Point;
  Vec3 position{0.0f};
  Vec3 direction{0.0f, -1.0f, 0.0f};  ///< direction in which it shines, unit length
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
  /// Image coordinates of a unit direction in world space: u and v in 0..1, v from the top.
  Vec2 imageUv(const Vec3& direction) const;
  /// Irradiance coefficients of the nine spherical harmonics of order <= 2, premultiplied so that
  /// E(n) = sum c_k Y_k(n) [Ramamoorthi2001].
  const std::array<Vec3, 9>& irradianceSh() const { return irradianceSh_; }
  Vec3 irradiance(const Vec3& normal) const;
  /// The image as RGB floats for upload, as stored in the file: scale and rotation are applied at
  /// look-up. Empty (0 x 0) for constant and gradient.
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
  std::array<Vec4, 9> ofFour_{};  ///< the coefficients with a fourth component 0
};

/// What shading needs of a scene at one time, besides the geometry.
struct Lighting {
  std::shared_ptr<const EnvironmentLight> environment;
  Vec3 ambient{0.0f};
  std::vector<WorldLight> lights;  ///< lights that are not baked
  bool highlights = false;         ///< whether `lights` cause highlights on glossy surfaces
  bool operator==(const Lighting&) const = default;
};
/// The lighting at `pose`. Lights that are marked as baked are left out if a full bake contains
/// them.
Lighting makeLighting(const scene::Scene& scene, const scene::Pose& pose,
                      std::shared_ptr<const EnvironmentLight> environment);

bool hasUnbakedLights(const scene::Scene& scene);

/// The light at a pose.
WorldLight worldLight(const scene::Light& light, const scene::Pose& pose);

/// Irradiance E_i of the formula above, without shadows; `normal` has unit length.
Vec3 lightIrradiance(const WorldLight& light, const Vec3& position, const Vec3& normal);

/// Radiance of the lights' highlights by the formula above. `normal`: the normal n of the
/// reflection; `direction`: from the viewer. All directions have unit length.
Vec3 lightHighlights(const std::vector<WorldLight>& lights, const Vec3& position,
                     const Vec3& normal, const Vec3& lobeHorizon, const Vec3& direction,
                     scene::Lobe lobe);

/// A shaded point of a surface, as a ray or a pixel receives it.
struct SurfacePoint {
  Vec3 position{0.0f};
  Vec3 normal{0.0f, 1.0f, 0.0f};  ///< shading normal with normal map, turned to the viewer
  Vec3 geometricNormal{0.0f, 1.0f, 0.0f};
  Vec3 diffuse{0.0f};          ///< radiance L of the formula above
  float specularLevel = 0.0f;  ///< s
  scene::Lobe lobe;
  Vec3 tint{1.0f};       ///< tint of the reflection; trace::reflectionWeights() applies it
  float f90 = 1.0f;      ///< what a GGX lobe reflects at the rim
  Vec3 highlight{0.0f};  ///< radiance of the lights' highlights
  int object = 0;        ///< id of the object
  bool bent = false;     ///< aboveSurface() has changed the normal
  /// Normal of the plane above which rays of the lobe stay: geometricNormal where the normal of a
  /// glossy lobe may have to be corrected (bendsNormals()), otherwise `normal`.
  Vec3 lobeHorizon{0.0f, 1.0f, 0.0f};
};

/// Minimum elevation (as a sine) of a mirrored ray above the triangle: kLeastElevation, or
/// kElevationShare times the viewer's own elevation if that is lower. As in Cycles'
/// ensure_valid_specular_reflection().
inline constexpr float kLeastElevation = 0.025f;
inline constexpr float kElevationShare = 0.9f;

/// Whether the normals of an object's reflective points may have to be corrected. False for planes,
/// refractive objects, and implicit surfaces (whose normals are exact), unless they have a normal
/// map.
bool bendsNormals(const scene::Scene& scene, const ObjectRange& range, int object);

/// Turns `normal` towards `geometric` until the mirrored ray leaves above the surface. Returns
/// whether that was necessary. All vectors have unit length; `geometric` is turned to the viewer,
/// `direction` comes from the viewer. With G = `geometric`, v = -`direction`, and X perpendicular
/// to G in the plane of both normals: n = X sin a + G cos a mirrors v to the elevation v.X sin 2a +
/// v.G cos 2a. This is solved for the largest a.
bool aboveSurface(const Vec3& geometric, const Vec3& direction, Vec3& normal);

/// The normal of a reflection is read from a level that is finer by this number than the level lod
/// of other look-ups. Our choice: of 0, 1 and 2 the best balance between noise and blur.
inline constexpr float kFinerLevels = 2.0f;

/// The value of `scatter` for sample (x, y) of the G-buffer, the same in every frame: a
/// low-discrepancy pattern [Roberts2018]. gbuffer.frag has the same numbers.
Vec2 scatterPlace(int x, int y);

/// The tint of a material's reflection at a point with this metallic value and albedo.
Vec3 reflectionTint(const scene::Material& material, float metallic, const Vec3& albedo);

/// Evaluates the surface at barycentric (u, v) of triangle `primitive` of object index `object`.
/// For an implicit surface, its gradient at `position` determines N and the visible side.
/// `direction` and `coneWidth` (metres, at the point) of the ray cone determine the mip level, as
/// in shading.glsl [Akenine2019]. `scatter`: the position (0..1 per axis) in the cone's footprint
/// on a normal map from which the normal of a reflection is read. For many points: shadeSurfaces().
SurfacePoint shadeSurface(const scene::Scene& scene, const Geometry& geometry,
                          const Lighting& lighting, int object, std::uint32_t primitive, float u,
                          float v, const Vec3& position, const Vec3& direction, float coneWidth,
                          const Vec2& scatter = Vec2(0.5f));

/// Whether the alpha mask removes the surface here. Rays ignore such hits.
bool isCutOut(const scene::Scene& scene, const Geometry& geometry, int object,
              std::uint32_t primitive, float u, float v);

/// Texels of the base level per unit of a slot's untransformed uv: max(width, height) times the
/// root of the transform's area scale. The formula of lod above multiplies it by uvPerMetre.
float textureScale(const scene::Scene& scene, const scene::TextureSlot& slot);

/// Trilinear sample in linear values, as textureLod() computes it.
Vec4 sampleTexture(const scene::Texture& texture, Vec2 uv, float lod);

}  // namespace catoptric::frame
