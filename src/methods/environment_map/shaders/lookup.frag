// Incoming radiance along the reflected ray from cube maps of the scene.
//   GLOSSY  1: the mip level whose filter is as wide as the lobe
//   MASKS   1: every sample is marked as an environment look-up
//   PROBES, BLEND, PROXY  see probes.glsl
#include "methods/environment_map/shaders/probes.glsl"
#include "methods/shared/shaders/box_exit.glsl"
#include "raster/shaders/lobe.glsl"
#include "raster/shaders/masks.glsl"
#include "raster/shaders/shading.glsl"

uniform mat3 rayFromSample;  // (sample position, 1) to a ray of 1 m along the axis, world space
uniform float levelOffset;   // 0.5 log2(4 / solid angle of a texel of level 0, sr)
uniform float lastLevel;
layout(binding = 0) uniform sampler2D normalSamples;  // xyz shading normal, a = g
layout(binding = kFirstPassUnit) uniform samplerCube cubeMaps[PROBES];

#if PROXY
uniform vec3 least;  // corners of the box, from the eye
uniform vec3 most;
uniform float radius;

// Metres from p, which is within the proxy, to where the unit direction d leaves it.
float exitOf(vec3 p, vec3 d, vec3 centre) {
#if PROXY == 1
  return max(boxExit(least, most, p, d), 0.0);
#else
  vec3 fromCentre = p - centre;
  float b = dot(fromCentre, d);
  return max(sqrt(max(b * b + radius * radius - dot(fromCentre, fromCentre), 0.0)) - b, 0.0);
#endif
}
#endif

// Counting would otherwise run the shader before the stencil test
layout(early_fragment_tests) in;
layout(std430, binding = 0) buffer Counts { uint bent; };

layout(location = 0) out vec4 reflection;
#if MASKS
layout(location = 1) out uint mask;
#endif

// What map i shows to a sample at `place` along the unit direction `reflected`.
vec3 lookUp(int i, vec3 place, vec3 reflected, float level) {
  vec4 around = textureLod(cubeMaps[i], reflected, level);
#if PROXY
  float metres = exitOf(place, reflected, centres[i]);
  vec3 seen = place + metres * reflected - centres[i];
#if GLOSSY
  // The lobe is as much narrower from the map's centre as that is farther away
  float farther = log2(max(metres, 1e-20) / max(length(seen), 1e-20));
  vec4 near = textureLod(cubeMaps[i], seen, clamp(level + farther, 0.0, lastLevel));
#else
  vec4 near = textureLod(cubeMaps[i], seen, level);
#endif
  // Alpha marks surfaces: the environment is infinitely far, also where they hide it from the map
  return mix(mix(around.rgb, environmentRadiance(reflected), around.a), near.rgb, near.a);
#else
  return around.rgb;
#endif
}

void main() {
  vec4 normalAndG = texelFetch(normalSamples, ivec2(gl_FragCoord.xy), 0);
  vec3 along = rayFromSample * vec3(gl_FragCoord.xy, 1.0);  // 1 m along the axis
  vec3 ray = normalize(along);
  vec3 reflected = reflect(ray, normalAndG.xyz);
#if GLOSSY
  // A texel of w rad, filtered bilinearly, has the variance w^2 / 4
  float lobe = lobeVariance(lobeOf(normalAndG.a), -dot(normalAndG.xyz, ray));
  float level = clamp(levelOffset + 0.5 * log2(lobe), 0.0, lastLevel);
#else
  const float level = 0.0;
#endif
#if BLEND || PROXY
  vec3 place = placeOf(along);
#else
  const vec3 place = vec3(0.0);
#endif
#if PROBES > 1
#if BLEND
  ivec2 maps;
  float second = shareOfSecond(nearestCentres(place, maps));
#else
  ivec2 maps = ivec2(mapOfObject());
  const float second = 0.0;
#endif
  // A loop, since samplers of an array are chosen alike in all samples
  vec3 radiance = vec3(0.0);
  for (int i = 0; i < PROBES; ++i) {
    float share = i == maps.x ? 1.0 - second : i == maps.y ? second : 0.0;
    if (share > 0.0) radiance += share * lookUp(i, place, reflected, level);
  }
#else
  vec3 radiance = lookUp(0, place, reflected, level);
#endif
  reflection = vec4(radiance, 1.0);
  bool below = isBent(normalAndG.a);
  if (below) atomicAdd(bent, 1u);
#if MASKS
  mask = kMaskEnvironment | (below ? kMaskBelowHorizon : 0u);
#endif
}
