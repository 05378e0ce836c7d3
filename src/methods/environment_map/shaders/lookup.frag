// Incoming radiance along the reflected ray from a cube map around the scene.
//   GLOSSY  1: the mip level whose filter is as wide as the lobe
//   MASKS   1: every sample is marked as an environment look-up
#include "raster/shaders/lobe.glsl"
#include "raster/shaders/masks.glsl"

uniform mat3 rayFromSample;  // (sample position, 1) to a ray of any length, world space
uniform float levelOffset;   // 0.5 log2(4 / solid angle of a texel of level 0, sr)
uniform float lastLevel;
layout(binding = 0) uniform sampler2D normalSamples;  // xyz shading normal, a = g
layout(binding = 1) uniform samplerCube cubeMap;

// Counting would otherwise run the shader before the stencil test
layout(early_fragment_tests) in;
layout(std430, binding = 0) buffer Counts { uint bent; };

layout(location = 0) out vec4 reflection;
#if MASKS
layout(location = 1) out uint mask;
#endif

void main() {
  vec4 normalAndG = texelFetch(normalSamples, ivec2(gl_FragCoord.xy), 0);
  vec3 ray = normalize(rayFromSample * vec3(gl_FragCoord.xy, 1.0));
  vec3 reflected = reflect(ray, normalAndG.xyz);
#if GLOSSY
  // A texel of w rad, filtered bilinearly, has the variance w^2 / 4
  float lobe = lobeVariance(lobeOf(normalAndG.a), -dot(normalAndG.xyz, ray));
  float level = clamp(levelOffset + 0.5 * log2(lobe), 0.0, lastLevel);
#else
  const float level = 0.0;
#endif
  reflection = vec4(textureLod(cubeMap, reflected, level).rgb, 1.0);
  bool below = isBent(normalAndG.a);
  if (below) atomicAdd(bent, 1u);
#if MASKS
  mask = kMaskEnvironment | (below ? kMaskBelowHorizon : 0u);
#endif
}
