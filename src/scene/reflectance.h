// The mapping between glTF's metallic-roughness model and the papers' specular level s, roughness g
// and Phong exponent n.
#pragma once

#include <algorithm>
#include <cmath>

#include "core/math.h"

namespace catoptric::scene {

/// Surfaces with a smaller s count as diffuse (s = 0), except after letDielectricsReflect(): glTF's
/// default dielectric reflects 4 %, which turns every plastic chair into a reflector. Our choice.
inline constexpr float kReflectiveThreshold = 0.05f;

/// At or below this g a surface with a Phong lobe counts as a mirror: one ray, no lobe. n(0.05) =
/// 320,000, whose lobe is narrower than a pixel of a 1024-pixel-wide frame of 60 degrees. Our
/// choice.
inline constexpr float kMirrorPhongRoughness = 0.05f;

/// s = metallic + (1 - metallic) F0, where F0 is the largest channel of the dielectric part's.
inline float specularLevel(float metallic, const Vec3& dielectricF0) {
  return metallic + (1.0f - metallic) * std::max({dielectricF0.x, dielectricF0.y, dielectricF0.z});
}

/// The tint of a metallic-roughness material is plain + albedo * metal. Multiplied by s it is
/// glTF's colour at normal incidence, F0 = (1 - metallic) dielectricF0 + metallic albedo. The tint
/// is exactly 1 for dielectrics without a colour and the albedo for metals.
struct TintShares {
  Vec3 plain{1.0f};
  float metal = 0.0f;
};
inline TintShares tintShares(float metallic, const Vec3& dielectricF0) {
  const float s = specularLevel(metallic, dielectricF0);
  if (!(s > 0.0f)) return {};
  return {(1.0f - metallic) * dielectricF0 / s, metallic / s};
}

/// glTF's F90, what Schlick's term reaches at the rim: mix(dielectricF90, 1, metallic).
inline float rimLevel(float metallic, float dielectricF90) {
  return 1.0f - (1.0f - metallic) * (1.0f - dielectricF90);
}

/// F0 of KHR_materials_ior and KHR_materials_specular: `factor` also is its F90.
inline Vec3 dielectricF0(float ior, float factor, const Vec3& color = Vec3(1.0f)) {
  const float r = (ior - 1.0f) / (ior + 1.0f);
  return factor * glm::min(r * r * color, Vec3(1.0f));
}

/// Converts g to the papers' Phong exponent about the mirrored ray: n = 2 / g^4 - 2. g = 1 gives n
/// = 0: a whole hemisphere. (glTF's roughness has another lobe: scene/lobe.h.)
inline float phongExponentFromRoughness(float g) {
  const float g2 = std::max(g, 1e-3f) * std::max(g, 1e-3f);
  return std::max(0.0f, 2.0f / (g2 * g2) - 2.0f);
}
inline float phongRoughnessFromExponent(float n) {
  return std::pow(2.0f / (n + 2.0f), 0.25f);
}

}  // namespace catoptric::scene
