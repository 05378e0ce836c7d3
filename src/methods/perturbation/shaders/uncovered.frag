// Samples of a reflector on which no virtual object shows: the environment along the mirrored or refracted ray.
// Samples of reflectors that the method cannot do: a cube map of the diffuse scene.
//   MASKS        1: every sample is marked
//   UNSUPPORTED  1: there are such reflectors
//   REFRACTS     1: there are reflectors that refract
//   DIRECTIONS   1: the reflector is one that another shows, and the rays onward are given
#include "raster/shaders/masks.glsl"
#include "raster/shaders/shading.glsl"

#if DIRECTIONS
layout(binding = 0) uniform sampler2D directionSamples;  // xyz unit: mirrored or refracted
#else
uniform mat3 rayFromSample;  // (sample position, 1) to a ray of any length, world space
layout(binding = 0) uniform sampler2D normalSamples;  // xyz shading normal, a = g
#endif
#if UNSUPPORTED || REFRACTS
layout(binding = 1) uniform usampler2D objectSamples;
// By object id: 0 mirrors, > 0 index of refraction before it / behind it, -1 unsupported
layout(binding = 3) uniform samplerBuffer bends;
#endif
#if UNSUPPORTED
layout(binding = 2) uniform samplerCube cubeMap;
uniform float levelOffset;  // 0.5 log2(4 / solid angle of a texel of level 0, sr)
uniform float lastLevel;
#endif

layout(location = 0) out vec4 reflection;
#if MASKS
layout(location = 1) out uint mask;
#endif

#if UNSUPPORTED
// Counting would otherwise run the shader before the stencil and depth tests
layout(early_fragment_tests) in;
layout(std430, binding = 1) buffer Count { uint unsupportedCount; };
#endif

void main() {
#if DIRECTIONS
  vec3 reflected = texelFetch(directionSamples, ivec2(gl_FragCoord.xy), 0).xyz;
#else
  vec4 normalAndG = texelFetch(normalSamples, ivec2(gl_FragCoord.xy), 0);
  vec3 ray = normalize(rayFromSample * vec3(gl_FragCoord.xy, 1.0));
  vec3 reflected = reflect(ray, normalAndG.xyz);
#if UNSUPPORTED || REFRACTS
  float bend = texelFetch(bends, int(texelFetch(objectSamples, ivec2(gl_FragCoord.xy), 0).r)).r;
  if (bend > 0.0) reflected = refract(ray, normalAndG.xyz, bend);
#endif
#endif
  vec3 radiance = environmentRadiance(reflected);
#if UNSUPPORTED
  if (bend < 0.0) {
    // The level whose filter is as wide as the lobe, as in methods/environment_map
    float g2 = normalAndG.a * normalAndG.a;
    float lobe = 1.0 / max(1.0, 2.0 / max(g2 * g2, 1e-12) - 1.0);
    float level = clamp(levelOffset + 0.5 * log2(lobe), 0.0, lastLevel);
    radiance = textureLod(cubeMap, reflected, level).rgb;
    atomicAdd(unsupportedCount, 1u);
  }
#endif
  reflection = vec4(radiance, 1.0);
#if MASKS
  mask = kMaskEnvironment;
#endif
}
