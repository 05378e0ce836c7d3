// The one mapping between glTF's metallic-roughness and the papers' specular level s, glossiness
// g and Phong exponent n.
#pragma once

#include <algorithm>
#include <cmath>

namespace catoptric::scene {

/// Below this s a surface counts as diffuse (s = 0): glTF's default dielectric reflects 4%, which
/// would make every plastic chair a reflector. Ours.
inline constexpr float kReflectiveThreshold = 0.05f;

/// At or below this g a surface with a Phong lobe counts as a mirror: one ray, no lobe. n(0.05) =
/// 320,000, whose lobe is narrower than a pixel of a 60 degree, 1024 pixel wide frame. Ours.
inline constexpr float kMirrorGlossiness = 0.05f;

/// s = metallic + (1 - metallic) F0, with F0 of the dielectric part.
inline float specularLevel(float metallic, float dielectricF0) {
  return metallic + (1.0f - metallic) * dielectricF0;
}

/// glTF's colour of a reflection at normal incidence, F0 = (1 - metallic) dielectricF0 + metallic
/// albedo, is s times the tint plain + albedo * metal. Exactly 1 for dielectrics, the albedo for
/// metals.
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

/// The papers' Phong exponent n about the mirrored ray as g: n = 2 / g^4 - 2. g = 1 gives n = 0: a
/// whole hemisphere. (glTF's roughness has another lobe: scene/lobe.h.)
inline float phongExponentFromGlossiness(float g) {
  const float g2 = std::max(g, 1e-3f) * std::max(g, 1e-3f);
  return std::max(0.0f, 2.0f / (g2 * g2) - 2.0f);
}
inline float glossinessFromPhongExponent(float n) {
  return std::pow(2.0f / (n + 2.0f), 0.25f);
}

}  // namespace catoptric::scene
