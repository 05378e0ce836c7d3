// Lobes of reflective places: how wide, how dense, by which model. One definition for the CPU; its
// twin for shaders is raster/shaders/lobe.glsl. Rays along lobes: trace/lobes/reflect.h.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "core/math.h"
#include "core/vector_versions.h"
#include "scene/reflectance.h"

namespace catoptric::scene {

enum class LobeModel : std::uint8_t {
  Phong,  ///< cos^n about the mirrored ray: the papers' s and g
  Ggx     ///< Trowbridge-Reitz normals, Smith's masking, Schlick's Fresnel: glTF's materials
};

/// At or below this roughness a GGX surface counts as a mirror: 63 % of its lobe lie within 2.4
/// mrad, as of a Phong lobe of g = kMirrorGlossiness (2.5 mrad). Ours.
inline constexpr float kMirrorRoughness = 0.03f;

/// A lobe's model and roughness in one number, as the G-buffer's normals carry it: a Phong lobe's
/// g, 0 to 1, or 2 + glTF's roughness.
struct Lobe {
  float code = 0.0f;

  static Lobe of(LobeModel model, float roughness) {
    return {model == LobeModel::Ggx ? 2.0f + roughness : roughness};
  }
  bool ggx() const { return code >= 2.0f; }
  float roughness() const { return ggx() ? code - 2.0f : code; }
  bool mirror() const {
    return ggx() ? code <= 2.0f + kMirrorRoughness : code <= kMirrorGlossiness;
  }
  /// GGX' alpha.
  float alpha() const { return roughness() * roughness(); }
};

/// GGX' half angle that holds 1 - 1/e of the lobe about the mirrored ray, radians. `cosine`: of the
/// view to the normal. At normal incidence 2 atan(alpha sqrt(e - 1)); across the plane of incidence
/// lobes are narrower, and the horizon cuts wide ones: a fit, within 5 % on average and 26 % at
/// most where cosine >= 0.2 (lobe_test measures it).
inline float ggxHalfAngleRad(float alpha, float cosine) {
  const float c = std::clamp(cosine, 0.2f, 1.0f);
  const float share = 0.5911f + 0.3849f * c + (0.606f - 1.1465f * c) * alpha;
  return 2.0f * std::atan(1.3108f * alpha) * share;
}

/// The exponent of the Phong lobe that is as wide: of what asks for a width alone.
inline float coneExponent(Lobe lobe, float cosine = 1.0f) {
  if (!lobe.ggx()) return phongExponentFromGlossiness(lobe.code);
  const float angle = std::max(ggxHalfAngleRad(lobe.alpha(), cosine), 1e-6f);
  return std::max(0.0f, 2.0f / (angle * angle) - 1.0f);
}

/// Smith's Lambda of GGX at a cosine to the normal above 0.
CATOPTRIC_INLINE float ggxLambda(float alpha, float cosine) {
  const float c2 = std::max(cosine * cosine, 1e-12f);
  return 0.5f * (std::sqrt(1.0f + alpha * alpha * std::max(1.0f - c2, 0.0f) / c2) - 1.0f);
}

/// GGX' density of normals at a cosine to the mean normal, with its sine's square.
CATOPTRIC_INLINE float ggxNormals(float alpha, float cosine, float sine2) {
  const float a2 = alpha * alpha;
  const float t = a2 * cosine * cosine + sine2;
  return a2 / (kPi * t * t);
}

/// A view of a rough surface in the frame whose z is the normal and whose xz plane holds the view.
struct GgxView {
  float alpha;
  float sine, cosine;  ///< of the view
  float lambda;        ///< Smith's, of the view
  float hemiX, hemiZ;  ///< the view where the surface is stretched to alpha = 1
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

/// A ray along a GGX lobe: its direction in the view's frame; weight: G2 / G1, the share of its
/// radiance that arrives where Fresnel's factor is 1, 0 below the surface; density per steradian.
struct GgxRay {
  float x, y, z;
  float weight, density;
};

/// The ray for a point (diskX, diskY) of the unit disk, uniform there: visible normals are sampled
/// [Heitz2018], density D G1 / (4 cosine). Plain operations, for vector code too.
CATOPTRIC_INLINE GgxRay ggxRay(const GgxView& view, float diskX, float diskY) {
  // Onto the hemisphere about the stretched view, of which the horizon hides a part
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

/// Radiance that a light in direction `light` sends back to the view per irradiance across that
/// direction, with Fresnel's factor 1: D G2 / (4 cosine), per steradian. Unit vectors; 0 where the
/// light is below the surface.
inline float ggxResponse(const GgxView& view, const Vec3& normal, const Vec3& toView,
                         const Vec3& light) {
  const float cosine = glm::dot(normal, light);
  if (!(cosine > 0.0f)) return 0.0f;
  const Vec3 half = normalizedOr(toView + light, normal);
  const Vec3 across = glm::cross(half, normal);
  const float normals = ggxNormals(view.alpha, glm::dot(half, normal), glm::dot(across, across));
  return normals / ((1.0f + view.lambda + ggxLambda(view.alpha, cosine)) * 4.0f * view.cosine);
}

/// Mean of Schlick's p = (1 - v.h)^5 over a GGX lobe, weighted by what its rays bring: Fresnel's
/// factor is F0 (1 - p) + p. A fit: off by 0.005 on average and 0.032 at most (lobe_test measures
/// it); exact for mirrors, (1 - cosine)^5.
inline float meanSchlick(float roughness, float cosine) {
  const float r = std::clamp(roughness, 0.0f, 1.0f);
  const float c = std::clamp(cosine, 0.0f, 1.0f);
  const float k0 = 0.001f + c * (-2.479f + c * (5.34f - 1.17f * c));
  const float k1 = 2.572f + c * (-1.081f - 4.764f * c);
  const float k2 = -3.33f + 3.275f * c + 1.173f * r;
  const float bent = r > kMirrorRoughness ? r * (k0 + r * (k1 + r * k2)) : 0.0f;
  const float m = 1.0f - std::clamp(c + bent, 0.0f, 1.0f);
  return (m * m) * (m * m) * m;
}

}  // namespace catoptric::scene
