// Highlights of lights on glossy surfaces: frame::lightHighlights(), the same formulas.
#include "lobe.glsl"

struct Lobe {
  vec3 normal;
  vec3 horizon;  // of its rays (frame::SurfacePoint::lobeHorizon)
  vec3 mirror;
  float exponent;
#if GGX_HIGHLIGHTS
  bool ggx;
  vec3 toView;
  GgxView view;
#endif
};

float lobeDensity(Lobe lobe, vec3 l) {
  float cosine = dot(lobe.mirror, l);
  vec3 across = cross(lobe.mirror, l);
  float q = min(dot(across, across), 1.0);
  float series = -0.5 * q * (1.0 + q * (0.5 + q * (1.0 / 3.0 + q * (0.25 + q * 0.2))));
  float logarithm = q < 0.1 ? series : log(max(cosine, 1e-20));
  float density = (lobe.exponent + 1.0) / (2.0 * kPi) * exp(lobe.exponent * logarithm);
  return cosine > 0.0 ? density : 0.0;
}

// Where l is above the surface: with what is folded up from below.
float foldedDensity(Lobe lobe, vec3 l) {
  float above = dot(l, lobe.horizon);
#if GGX_HIGHLIGHTS
  if (lobe.ggx) return above > 0.0 ? ggxResponse(lobe.view, lobe.normal, lobe.toView, l) : 0.0;
#endif
  return above > 0.0
             ? lobeDensity(lobe, l) + lobeDensity(lobe, l - 2.0 * above * lobe.horizon)
             : 0.0;
}

vec3 towardsLight(int i, vec3 x, vec3 normal) {
  vec3 l = frame.lights[i].positionRange.xyz - x;
  float length2 = dot(l, l);
  return length2 > 0.0 ? l * inversesqrt(length2) : normal;
}
vec3 directionalHighlight(int i, vec3 x, Lobe lobe) {
  vec3 l = -frame.lights[i].directionOuter.xyz;
  return directionalLight(i, l) * foldedDensity(lobe, l);
}
vec3 pointHighlight(int i, vec3 x, Lobe lobe) {
  vec3 l = towardsLight(i, x, lobe.normal);
  return pointLight(i, x, l) * foldedDensity(lobe, l);
}
vec3 spotHighlight(int i, vec3 x, Lobe lobe) {
  vec3 l = towardsLight(i, x, lobe.normal);
  return spotLight(i, x, l) * foldedDensity(lobe, l);
}

vec3 lightHighlights(vec3 x, vec3 normal, vec3 horizon, vec3 direction, float code) {
  Lobe lobe;
  lobe.normal = normal;
  lobe.horizon = horizon;
  lobe.mirror = normalize(reflect(direction, normal));
  lobe.exponent = isGgx(code) ? 0.0 : phongExponent(code);
#if GGX_HIGHLIGHTS
  lobe.ggx = isGgx(code);
  lobe.toView = -direction;
  lobe.view = ggxView(roughnessOf(code) * roughnessOf(code), -dot(normal, direction));
#endif
  return min(HIGHLIGHT_SUM, vec3(1e30));
}
