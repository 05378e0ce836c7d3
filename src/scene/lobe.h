// Reflection lobes of a surface point: model, width and density. This is the CPU's version;
// shaders use raster/shaders/lobe.glsl. trace/lobes/reflect.h makes rays of lobes.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "core/math.h"
#include "core/vector_versions.h"
#include "scene/reflectance.h"

namespace catoptric::scene {

enum class LobeModel : std::uint8_t {
  Phong,  ///< cos^n about the mirrored ray, as in the papers: s and g
  Ggx     ///< Trowbridge-Reitz normals, Smith's masking, Schlick's Fresnel, as in glTF
};

/// At or below this roughness a GGX surface counts as a mirror: 63 % of the lobe lies within 2.4
/// mrad of its axis. For a Phong lobe with g = kMirrorPhongRoughness it is 2.5 mrad. Our choice.
inline constexpr float kMirrorGgxRoughness = 0.03f;

/// A lobe's model and roughness in one number, which the G-buffer stores with the normal: g (0 to
/// 1) of a Phong lobe, or 2 + glTF's roughness.
struct Lobe {
  float code = 0.0f;

  static Lobe of(LobeModel model, float roughness) {
    return {model == LobeModel::Ggx ? 2.0f + roughness : roughness};
  }
  bool ggx() const { return code >= 2.0f; }
  float roughness() const { return ggx() ? code - 2.0f : code; }
  bool mirror() const {
    return ggx() ? code <= 2.0f + kMirrorGgxRoughness : code <= kMirrorPhongRoughness;
  }
  /// The parameter alpha of GGX.
  float alpha() const { return roughness() * roughness(); }
};

/// Half angle (radians) of the cone about the mirror direction that contains 1 - 1/e of a GGX lobe.
/// `cosine`: between view direction and normal. At normal incidence it is 2 atan(alpha sqrt(e -
/// 1)). At grazing angles the lobe is narrower across the plane of incidence, and the horizon cuts
/// wide lobes. The formula is a fit with a mean error of 5 % and a maximum of 26 % for cosine >=
/// 0.2 (see lobe_test).
inline float ggxHalfAngleRad(float alpha, float cosine) {
  const float c = std::clamp(cosine, 0.2f, 1.0f);
  const float share = 0.5911f + 0.3849f * c + (0.606f - 1.1465f * c) * alpha;
  return 2.0f * std::atan(1.3108f * alpha) * share;
}

/// Exponent of the Phong lobe of equal width, for code that needs only a width.
inline float coneExponent(Lobe lobe, float cosine = 1.0f) {
  if (!lobe.ggx()) return phongExponentFromRoughness(lobe.code);
  const float angle = std::max(ggxHalfAngleRad(lobe.alpha(), cosine), 1e-6f);
  return std::max(0.0f, 2.0f / (angle * angle) - 1.0f);
}

/// Smith's Lambda of GGX for a direction with this cosine (above 0) to the normal.
CATOPTRIC_INLINE float ggxLambda(float alpha, float cosine) {
  const float c2 = std::max(cosine * cosine, 1e-12f);
  return 0.5f * (std::sqrt(1.0f + alpha * alpha * std::max(1.0f - c2, 0.0f) / c2) - 1.0f);
}

/// The GGX normal distribution D. `cosine` and `sine2` (squared sine) belong to the angle between
/// half vector and normal.
CATOPTRIC_INLINE float ggxNormals(float alpha, float cosine, float sine2) {
  const float a2 = alpha * alpha;
  const float t = a2 * cosine * cosine + sine2;
  return a2 / (kPi * t * t);
}

/// A view direction in tangent space: z is the normal, and the view lies in the xz plane.
struct GgxView {
  float alpha;
  float sine, cosine;  ///< of the angle between view and normal
  float lambda;        ///< Smith's Lambda of the view
  float hemiX, hemiZ;  ///< the view direction in hemisphere (stretched) space [Heitz2018]
  /// Density of rays in the mirrored direction, per steradian.
  float peak() const { return 1.0f / (4.0f * kPi * alpha * alpha * cosine * (1.0f + lambda)); }
};
inline GgxView ggxView(float alpha, float cosine) {
  GgxView view;
  view.alpha = std::max(alpha, 1e-6f);
  view.cosine = std::clamp(cosine, 1e-4f, 1.0f);
  view.sine = std::sqrt(std::max(0.0f, 1.0f - view.cosine * view.cosine));
  view.lambda = ggxLambda(view.alpha, view.cosine);
  const float x = view.alpha * view.sine;
  const float inverse = 1.0f / std::sqrt(x * x + view.cosine * view.cosine);
  view.hemiX = x * inverse;
  view.hemiZ = view.cosine * inverse;
  return view;
}

/// A reflected ray of a GGX lobe. x, y, z: its direction in the frame of GgxView. weight: G2 / G1
/// (throughput without the Fresnel term; 0 below the surface). density: per steradian.
struct GgxRay {
  float x, y, z;
  float weight, density;
};

/// Maps a uniformly distributed point of the unit disk to a reflected ray by sampling visible
/// normals [Heitz2018], with density D G1 / (4 cosine). Has no branches, so that loops over it can
/// be vectorized.
CATOPTRIC_INLINE GgxRay ggxRay(const GgxView& view, float diskX, float diskY) {
  // Project onto the visible part of the hemisphere around the stretched view direction
  const float s = 0.5f * (1.0f + view.hemiZ);
  const float chord = std::sqrt(std::max(0.0f, 1.0f - diskX * diskX));
  const float t = (1.0f - s) * chord + s * diskY;
  const float up = std::sqrt(std::max(0.0f, 1.0f - diskX * diskX - t * t));
  const float hx = view.alpha * (up * view.hemiX - t * view.hemiZ);
  const float hy = view.alpha * diskX;
  const float hz = std::max(up * view.hemiZ + t * view.hemiX, 0.0f);
  const float inverse = 1.0f / std::sqrt(std::max(hx * hx + hy * hy + hz * hz, 1e-30f));
  const float nx = hx * inverse;
  const float ny = hy * inverse;
  const float nz = hz * inverse;
  const float twice = 2.0f * (view.sine * nx + view.cosine * nz);
  GgxRay ray{twice * nx - view.sine, twice * ny, twice * nz - view.cosine, 0.0f, 0.0f};
  const float above = 1.0f + view.lambda;
  const float masked = above + ggxLambda(view.alpha, ray.z);
  ray.weight = ray.z > 0.0f ? above / masked : 0.0f;
  ray.density = ggxNormals(view.alpha, nz, nx * nx + ny * ny) / (above * 4.0f * view.cosine);
  return ray;
}

/// GGX BRDF times cosine, without Fresnel: D G2 / (4 cosine) per steradian. This is the reflected
/// radiance towards the viewer per irradiance perpendicular to `light`. All vectors have unit
/// length; 0 if the light is below the surface.
inline float ggxResponse(const GgxView& view, const Vec3& normal, const Vec3& toView,
                         const Vec3& light) {
  const float cosine = glm::dot(normal, light);
  if (!(cosine > 0.0f)) return 0.0f;
  const Vec3 half = normalizedOr(toView + light, normal);
  const Vec3 across = glm::cross(half, normal);
  const float normals = ggxNormals(view.alpha, glm::dot(half, normal), glm::dot(across, across));
  return normals / ((1.0f + view.lambda + ggxLambda(view.alpha, cosine)) * 4.0f * view.cosine);
}

/// Mean of Schlick's p = (1 - v.h)^5 over a GGX lobe, weighted by the rays' G2 / G1. The Fresnel
/// factor is then F0 (1 - p) + p. A fit with a mean error of 0.005 and a maximum of 0.032 (see
/// lobe_test); exact for mirrors, (1 - cosine)^5.
inline float meanSchlick(float roughness, float cosine) {
  const float r = std::clamp(roughness, 0.0f, 1.0f);
  const float c = std::clamp(cosine, 0.0f, 1.0f);
  const float k0 = 0.001f + c * (-2.479f + c * (5.34f - 1.17f * c));
  const float k1 = 2.572f + c * (-1.081f - 4.764f * c);
  const float k2 = -3.33f + 3.275f * c + 1.173f * r;
  const float bent = r > kMirrorGgxRoughness ? r * (k0 + r * (k1 + r * k2)) : 0.0f;
  const float m = 1.0f - std::clamp(c + bent, 0.0f, 1.0f);
  return (m * m) * (m * m) * m;
}

}  // namespace catoptric::scene
