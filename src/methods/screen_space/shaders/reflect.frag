// What a sample's reflected rays see of the frame itself.
//   LOBES          rays of a lobe; 0: one mirror ray
//   LOBE_HORIZONS  1: rays of lobes are bounded by the G-buffer's lobe horizons, else by normals
//   FALLBACK       0: black; 1: the cube map; 2: rays are traced later
//   MASKS          1: samples are marked by the ends of their rays
#include "raster/shaders/lobe.glsl"
#include "march.glsl"
#if LOBES
#include "methods/shared/shaders/lobe_rays.glsl"
#endif
#include "raster/shaders/masks.glsl"
#include "raster/shaders/shading.glsl"

layout(binding = 2, rgba32f) readonly uniform image2D diffuseSamples;
#if LOBES && LOBE_HORIZONS
layout(binding = 3, r32ui) readonly uniform uimage2D lobeHorizons;
#endif
#if FALLBACK == 1
layout(binding = 1) uniform samplerCube cubeMap;
uniform float levelOffset;  // 0.5 log2(4 / solid angle of a texel of level 0, sr)
uniform float lastLevel;
#endif
uniform mat3 rayFromSample;  // (sample position, 1) to a ray of 1 m along the axis, world space

// Counting would otherwise run the shader before the stencil test
layout(early_fragment_tests) in;
layout(std430, binding = 0) buffer Counts { uint counts[kCounts]; };

layout(location = 0) out vec4 reflection;
#if MASKS
layout(location = 1) out uint mask;
#endif
#if FALLBACK == 2
layout(location = 1 + MASKS) out uint missed;  // 1: a ray found nothing
#endif

const uint kMaskOf[kCounts] = uint[](0u, kMaskSky, kMaskOffscreen, kMaskBehind, kMaskBackface,
                                     kMaskTowardCamera, kMaskSteps, kMaskBelowHorizon);

// What a ray sees; counts its end.
vec3 seenAlong(vec3 place, vec3 direction, float level, inout uint bits) {
  uint own = imageLoad(objectSamples, ivec2(gl_FragCoord.xy)).r;
  March found = march(screenRay(eyeFromWorld * place, eyeFromWorld * direction, direction, own));
  bits |= kMaskOf[found.end];
  atomicAdd(counts[found.end], 1u);
  if (found.end == kHit) return imageLoad(diffuseSamples, found.at).rgb;
  if (found.end == kSky) return environmentRadiance(direction);
#if FALLBACK == 1
  bits |= kMaskEnvironment;
  return textureLod(cubeMap, direction, level).rgb;
#else
  return vec3(0.0);
#endif
}

void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  vec4 normalAndLobe = imageLoad(normalSamples, at);
  vec3 along = rayFromSample * vec3(gl_FragCoord.xy, 1.0);
  vec3 place = along * (nearMetres / max(texelFetch(pyramid, at, 0).r, 1e-30));
  vec3 incoming = normalize(along);
  vec3 mirror = reflect(incoming, normalAndLobe.xyz);
  uint bits = isBent(normalAndLobe.a) ? kMaskBelowHorizon : 0u;
#if LOBES
  vec3 horizon = normalAndLobe.xyz;
#if LOBE_HORIZONS
  horizon = lobeHorizonOf(imageLoad(lobeHorizons, at).r, horizon);
#endif
  float code = lobeOf(normalAndLobe.a);
  SampleLobe lobe = sampleLobe(code, normalAndLobe.xyz, incoming, mirror, horizon);
  vec2 shift = lobeShift(at);
  int rays = isMirrorLobe(code) ? 1 : LOBES;
  float level = 0.0;
#if FALLBACK == 1
  float variance = lobeVariance(code, -dot(normalAndLobe.xyz, incoming));
  level = rays == 1 ? 0.0 : clamp(levelOffset + 0.5 * log2(variance / float(rays)), 0.0, lastLevel);
#endif
  vec3 sum = vec3(0.0);
  for (int i = 0; i < rays; ++i) {
    float weight = 1.0;
    bool below = false;
    vec3 direction =
        rays == 1 ? mirror : lobeDirection(lobe, i, rays, shift, weight, below);
    bits |= below ? kMaskBelowHorizon : 0u;
    if (weight > 0.0) sum += weight * seenAlong(place, direction, level, bits);
  }
  reflection = vec4(sum / float(rays), 1.0);
#else
  reflection = vec4(seenAlong(place, mirror, 0.0, bits), 1.0);
#endif
  if ((bits & kMaskBelowHorizon) != 0u) atomicAdd(counts[kBelow], 1u);
#if MASKS
  mask = bits;
#endif
#if FALLBACK == 2
  const uint kMisses = kMaskOffscreen | kMaskBehind | kMaskBackface | kMaskTowardCamera | kMaskSteps;
  missed = (bits & kMisses) != 0u ? 1u : 0u;
#endif
}
