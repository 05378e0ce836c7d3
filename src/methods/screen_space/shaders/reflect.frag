// What a sample's reflected rays see of the frame itself.
//   LOBES          rays of a lobe; 0: one mirror ray
//   LOBE_HORIZONS  1: rays of lobes are bounded by the G-buffer's lobe horizons, else by normals
//   CONE           1: instead of a lobe's rays, one that is as wide as the lobe
//   FOUND          1: the end of each ray is stored, and where it hit
//   FALLBACK       0: black; 1: the cube map; 2: rays are traced later; 3: another method follows
//   MASKS          1: samples are marked by the ends of their rays
//   LAYERS         2: there is a second layer of surfaces (march.glsl)
#include "raster/shaders/lobe.glsl"
#include "march.glsl"
#if LOBES
#include "methods/shared/shaders/lobe_rays.glsl"
#endif
#include "raster/shaders/masks.glsl"
#include "raster/shaders/shading.glsl"

layout(binding = 2, rgba32f) readonly uniform image2D diffuseSamples;
#if LAYERS == 2
layout(binding = 6, rgba32f) readonly uniform image2D secondColours;  // radiance, s
#endif
#if LOBES && LOBE_HORIZONS
layout(binding = 3, r32ui) readonly uniform uimage2D lobeHorizons;
#endif
#if FOUND
layout(binding = 5, r32ui) writeonly uniform uimage2DArray endsOfRays;  // a layer for each ray of a lobe
#endif
#if FALLBACK == 1
layout(binding = 1) uniform samplerCube cubeMap;
uniform float levelOffset;  // 0.5 log2(4 / solid angle of a texel of level 0, sr)
uniform float lastLevel;
#endif
#if CONE
layout(binding = 2) uniform sampler2D colours;  // of what the frame shows, times the share a that it shows
#if LAYERS == 2
layout(binding = 3) uniform sampler2D coloursOfSecond;
#endif

// What the frame shows where a cone of this variance (steradians per axis) meets it.
vec3 colourAround(vec3 place, March found, float variance) {
  float axis = nearMetres / depthAt(found.at, found.layer);
  vec2 window = vec2(found.at) + 0.5;
  vec3 hit = vec3((window - 0.5 * size) / focal, 1.0) * axis;
  float samples2 = variance * dot(hit - place, hit - place) * (focal.y * focal.y) / (axis * axis);
  // A texel of w samples, filtered bilinearly, has the variance w^2 / 4
  float level = clamp(0.5 * log2(max(4.0 * samples2, 1e-6)), 0.0, float(kLastLevel));
  vec2 texel = window / vec2(textureSize(colours, 0));
#if LAYERS == 2
  vec4 seen = found.layer == 1 ? textureLod(coloursOfSecond, texel, level)
                               : textureLod(colours, texel, level);
#else
  vec4 seen = textureLod(colours, texel, level);
#endif
  return seen.rgb / max(seen.a, 1e-6);
}
#endif
uniform mat3 rayFromSample;  // (sample position, 1) to a ray of 1 m along the axis, world space

// Counting would otherwise run the shader before the stencil test
layout(early_fragment_tests) in;
layout(std430, binding = 0) buffer Counts { uint counts[kCounts]; };

layout(location = 0) out vec4 reflection;
#if MASKS
layout(location = 1) out uint mask;
#endif
#if FALLBACK >= 2
layout(location = 1 + MASKS) out uint missed;  // a ray found nothing: 1, or the sample's object
#endif

// By the end of a ray
const uint kMaskOf[kBelow] = uint[](0u, kMaskSky, kMaskOffscreen, kMaskBehind, kMaskBackface,
                                    kMaskTowardCamera, kMaskSteps);

// The diffuse radiance of what a ray from `place` has hit. Variance: of a cone.
vec3 radianceOf(March found, vec3 place, float variance, inout uint bits) {
#if LAYERS == 2
  vec4 shown = found.layer == 1 ? imageLoad(secondColours, found.at)
                                : imageLoad(diffuseSamples, found.at);
  if (found.layer == 1) atomicAdd(counts[kSecondHit], 1u);
#else
  vec4 shown = imageLoad(diffuseSamples, found.at);
#endif
  if (shown.a > 0.0) {
    bits |= kMaskViewColour;
    atomicAdd(counts[kViewColour], 1u);
  }
#if CONE
  return colourAround(place, found, variance);
#else
  return shown.rgb;
#endif
}

// What ray `index` of a sample sees, `sky` over the background; counts its end. Variance: of a cone.
vec3 seenAlong(vec3 place, vec3 direction, int index, vec3 sky, float level, float variance,
               inout uint bits) {
  uint own = imageLoad(objectSamples, ivec2(gl_FragCoord.xy)).r;
  vec3 fromEye = eyeFromWorld * place;
  March found = march(screenRay(fromEye, eyeFromWorld * direction, direction, own));
  bits |= kMaskOf[found.end];
  atomicAdd(counts[found.end], 1u);
#if FOUND
  bool hit = found.end == kHit;
  uint where = hit ? uint(found.at.x) << 4 | uint(found.at.y) << 18 : 0u;
  uint code = uint(hit && found.layer == 1 ? kSecondHit : found.end) + 1u;
  imageStore(endsOfRays, ivec3(ivec2(gl_FragCoord.xy), index), uvec4(code | where));
#endif
  if (found.end == kHit) return radianceOf(found, fromEye, variance, bits);
  if (found.end == kSky) return sky;
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
  float variance = lobeVariance(code, -dot(normalAndLobe.xyz, incoming));
  float level = 0.0;
#if FALLBACK == 1
  float part = CONE == 1 ? variance : variance / float(rays);
  level = isMirrorLobe(code) ? 0.0 : clamp(levelOffset + 0.5 * log2(part), 0.0, lastLevel);
#endif
  vec3 sum = vec3(0.0);
  vec3 middle = vec3(0.0);
  float weights = 0.0;
  for (int i = 0; i < rays; ++i) {
    float weight = 1.0;
    bool below = false;
    vec3 direction =
        isMirrorLobe(code) ? mirror : lobeDirection(lobe, i, rays, shift, weight, below);
    bits |= below ? kMaskBelowHorizon : 0u;
    vec3 sky = environmentRadiance(direction);
#if CONE
    sum += weight * sky;
    middle += weight * direction;
    weights += weight;
#else
    if (weight > 0.0) sum += weight * seenAlong(place, direction, i, sky, level, 0.0, bits);
#endif
  }
#if CONE
  // The cone has the rays' mean direction and weight
  if (weights > 0.0)
    sum = weights * seenAlong(place, normalize(middle), 0, sum / weights, level, variance, bits);
#endif
  reflection = vec4(sum / float(rays), 1.0);
#else
  reflection = vec4(seenAlong(place, mirror, 0, environmentRadiance(mirror), 0.0, 0.0, bits), 1.0);
#endif
  if ((bits & kMaskBelowHorizon) != 0u) atomicAdd(counts[kBelow], 1u);
#if MASKS
  mask = bits;
#endif
#if FALLBACK >= 2
  const uint kMisses = kMaskOffscreen | kMaskBehind | kMaskBackface | kMaskTowardCamera | kMaskSteps;
  uint marked = FALLBACK == 2 ? 1u : imageLoad(objectSamples, at).r;
  missed = (bits & kMisses) != 0u ? marked : 0u;
#endif
}
