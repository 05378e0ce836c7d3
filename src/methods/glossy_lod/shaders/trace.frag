// Radiance along the rays of a reflective sample by ray tracing in geometry images.
//   LOBES  1: rays of a Phong lobe; 0: one mirror ray
//   MASKS  1: marks are written
//   AUTOMATIC  1: rays and alpha by the exponent [Yu2008, section 4]
#include "raster/shaders/gloss.glsl"
#include "raster/shaders/masks.glsl"
#include "raster/shaders/shading.glsl"
#include "methods/shared/shaders/lobe_rays.glsl"
#include "traverse.glsl"
#include "filter.glsl"

uniform mat3 rayFromPixel;  // (sample position, 1) to a ray that advances 1 m along the axis
uniform vec3 eye;
uniform float nearMetres;
uniform float spread;        // of a sample's ray cone, radians
uniform int samplesPerPixel;  // per axis
uniform int raysOfLobe;
uniform float alphaOfAll;
layout(binding = kNormalsUnit) uniform sampler2D normalSamples;  // xyz normal, a = g (gloss.glsl)
layout(binding = kDepthsUnit) uniform sampler2D depthSamples;    // reversed-Z

layout(std430, binding = kCountsBinding) buffer Counts { uint counts[]; };

// Counting would otherwise run the shader before the stencil test
layout(early_fragment_tests) in;

layout(location = 0) out vec4 reflection;
#if MASKS
layout(location = 1) out uint mask;
#endif

// Low and high halves of sums that pass 32 bits.
void count(int what, uint add) {
  uint before = atomicAdd(counts[2 * what], add);
  if (before + add < before) atomicAdd(counts[2 * what + 1], 1u);
}

// As trace::surfaceOffset() for what is not hit itself (trace::rayOffset())
float offsetOf(vec3 position, float metres) {
  vec3 a = abs(position);
  return max(max(max(a.x, a.y), max(a.z, metres)) * (32.0 * 1.1920929e-7), 1e-12);
}

void main() {
  ivec2 sampleAt = ivec2(gl_FragCoord.xy);
  vec4 normalAndG = texelFetch(normalSamples, sampleAt, 0);
  vec3 ray = rayFromPixel * vec3(gl_FragCoord.xy, 1.0);
  float depth = texelFetch(depthSamples, sampleAt, 0).r;
  ray *= nearMetres / max(depth, 1e-30);
  float metres = length(ray);
  vec3 position = eye + ray;
  vec3 normal = normalAndG.xyz;
  bool bent = isBent(normalAndG.a);
  normalAndG.a = glossOf(normalAndG.a);
  vec3 mirror = normalize(reflect(ray / metres, normal));
  vec3 origin = position + normal * offsetOf(position, metres);
  bool lobe = LOBES == 1 && normalAndG.a > kMirrorGlossiness;
  float exponent = lobeExponent(normalAndG.a);
  int rays = lobe ? raysOfLobe : 1;
  float alpha = alphaOfAll;
#if AUTOMATIC
  bool sharp = exponent > kSharpExponent;
  rays = lobe ? (sharp ? kSharpRays : kBroadRays) : 1;
  alpha = sharp ? kSharpAlpha : kBroadAlpha;
#endif
  vec2 shift = lobeShift(sampleAt, samplesPerPixel);
  vec3 sum = vec3(0.0);
  uint misses = 0u;
  uint folded = 0u;
  Visits visits = Visits(0u, 0u, 0u);
  for (int k = 0; k < rays; ++k) {
    vec3 direction = mirror;
    Width width = Width(spread * metres, spread);
    bool below = false;
#if LOBES
    if (lobe) {
      float density;
      direction = lobeDirection(mirror, exponent, k, rays, shift, density);
      // [Yu2008] Eq. (5)
      width = Width(0.0, sqrt(1.0 / (float(rays) * density)));
    }
#endif
    direction = foldedUp(direction, normal, below);
    Found found = traverse(origin, direction, width, alpha, visits);
    bool missed = found.node == kNothing;
    vec3 met = missed ? environmentRadiance(direction)
                      : seen(found, direction, width.base + width.slope * found.metres);
    sum += met;
    misses += missed ? 1u : 0u;
    folded += below || bent ? 1u : 0u;
  }
  reflection = vec4(sum / float(rays), 1.0);
  count(kCountRays, uint(rays));
  count(kCountMisses, misses);
  count(kCountBelowHorizon, folded);
  count(kCountVisits, visits.nodes);
  count(kCountQuads, visits.quads);
  count(kCountStopped, visits.stopped);
#if MASKS
  mask = (misses > 0u ? kMaskSky : 0u) | (folded > 0u ? kMaskBelowHorizon : 0u);
#endif
}
