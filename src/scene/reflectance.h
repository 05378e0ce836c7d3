// The mapping between glTF's metallic-roughness model and the papers' specular level s, roughness g
// and Phong exponent n.
#pragma once

#include <algorithm>
#include <cmath>

namespace catoptric::scene {

/// Surfaces with a smaller s count as diffuse (s = 0), except after letDielectricsReflect(): glTF's
/// default dielectric reflects 4 %, which turns every plastic chair into a reflector. Our choice.
inline constexpr float kReflectiveThreshold = 0.05f;

/// At or below this g a surface with a Phong lobe counts as a mirror: one ray, no lobe. n(0.05) =
/// 320,000, whose lobe is narrower than a pixel of a 1024-pixel-wide frame of 60 degrees. Our
/// choice.
inline constexpr float kMirrorPhongRoughness = 0.05f;

/// s = metallic + (1 - metallic) F0, where F0 belongs to the dielectric part.
inline float specularLevel(float metallic, float dielectricF0) {
  return metallic + (1.0f - metallic) * dielectricF0;
}

/// The tint of a metallic-roughness material is plain + albedo * metal. Multiplied by s it is
/// glTF's colour at normal incidence, F0 = (1 - metallic) dielectricF0 + metallic albedo. The tint
/// is exactly 1 for dielectrics and the albedo for metals.
struct TintShares {
  float plain = 1.0f;
  float metal = 0.0f;
};
inline TintShares tintShares(float metallic, float dielectricF0) {
  const float plain = (1.0f - metallic) * dielectricF0;
  const float s = metallic + plain;
  if (!(s > 0.0f)) return {};
  return {plain / s, metallic / s};
}

/// F0 = ((ior - 1) / (ior + 1))^2 * specular factor.
inline float dielectricF0(float ior, float specularFactor) {
  const float r = (ior - 1.0f) / (ior + 1.0f);
  return std::min(1.0f, r * r * specularFactor);
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
