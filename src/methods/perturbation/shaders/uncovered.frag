// Samples of a reflector on which no virtual object shows: the environment along the mirrored or refracted ray.
//   MASKS        1: every sample is marked
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
#if REFRACTS
layout(binding = 1) uniform usampler2D objectSamples;
// By object id: 0 mirrors, > 0 index of refraction before it / behind it
layout(binding = 3) uniform samplerBuffer bends;
#endif

layout(location = 0) out vec4 reflection;
#if MASKS
layout(location = 1) out uint mask;
#endif

void main() {
#if DIRECTIONS
  vec3 reflected = texelFetch(directionSamples, ivec2(gl_FragCoord.xy), 0).xyz;
#else
  vec4 normalAndG = texelFetch(normalSamples, ivec2(gl_FragCoord.xy), 0);
  vec3 ray = normalize(rayFromSample * vec3(gl_FragCoord.xy, 1.0));
  vec3 reflected = reflect(ray, normalAndG.xyz);
#if REFRACTS
  float bend = texelFetch(bends, int(texelFetch(objectSamples, ivec2(gl_FragCoord.xy), 0).r)).r;
  if (bend > 0.0) reflected = refract(ray, normalAndG.xyz, bend);
#endif
#endif
  vec3 radiance = environmentRadiance(reflected);
  reflection = vec4(radiance, 1.0);
#if MASKS
  mask = kMaskEnvironment;
#endif
}
