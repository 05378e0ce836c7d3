// The weights of a mirror that is seen in a mirror (trace::reflectionWeights).
//   FRESNEL  1: with Schlick's term
#include "raster/shaders/lobe.glsl"
#include "raster/shaders/surface.glsl"

// rgb: of what it reflects; a: 1 + the weight of its diffuse radiance
layout(location = 0) out vec4 weights;

void main() {
  cutOut();
  Surface surface = surfaceSeen();
  float s = surface.s;
  float cosine = -dot(normalize(fragmentFromEye()), surface.normal);
  if (isGgx(surface.lobe)) {
    float p = s > 0.0 ? meanSchlick(roughnessOf(surface.lobe), cosine) : 0.0;
    float f90 = surface.tint.a;
    weights = vec4(s * surface.tint.rgb * (1.0 - p) + f90 * p,
                   1.0 + (1.0 - s) * (1.0 - p) + (1.0 - f90) * p);
    return;
  }
#if FRESNEL
  float c = clamp(1.0 - cosine, 0.0, 1.0);
  s += s > 0.0 ? (1.0 - s) * (c * c) * (c * c) * c : 0.0;
#endif
  weights = vec4(s * surface.tint.rgb, 2.0 - s);
}
