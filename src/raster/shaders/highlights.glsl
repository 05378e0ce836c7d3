// Highlights of lights on glossy surfaces: frame::lightHighlights(), the same formulas.
#include "gloss.glsl"

struct Lobe {
  vec3 normal;
  vec3 horizon;  // of its rays (frame::SurfacePoint::lobeHorizon)
  vec3 mirror;
  float exponent;
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

vec3 lightHighlights(vec3 x, vec3 normal, vec3 horizon, vec3 direction, float g) {
  float g2 = max(g, 1e-3) * max(g, 1e-3);
  Lobe lobe = Lobe(normal, horizon, normalize(reflect(direction, normal)),
                   max(0.0, 2.0 / (g2 * g2) - 2.0));
  return min(HIGHLIGHT_SUM, vec3(1e30));
}
