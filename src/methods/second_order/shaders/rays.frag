// Radiance along the reflected rays of a sample by walking over its cluster's depth image [Wang2014,
// section 3.4]: one mirror ray, or RAYS rays of a lobe.
//   LOBES          1: rays of a lobe
//   NEIGHBOURHOOD  1: of a lobe one ray is walked, the others are looked up at its distance
//   FADE           1: rays of a lobe end at `reach` (1 - g) / g metres, fading to the diffuse colour
//   SELF           1: rays of concave clusters are intersected with their own object's samples, too;
//                  2: all rays are
//   LAYERS         2: rays that pass behind what they meet look for it in a second depth layer, too
//   FOUND          1: what each ray found is written, to be compared with Embree's rays
//   LAMPS          1: samples of lobes that see what is brighter than white are marked, to be traced
//   LOBE_HORIZONS  1: rays of lobes are bounded by the G-buffer's lobe horizons, else by normals
#include "raster/shaders/lobe.glsl"
#include "marks.glsl"
#include "self_intersect.glsl"
#include "walk.glsl"
#if LOBES
#include "fallback.glsl"
#include "lobe.glsl"
#endif

#if LOBES
#if LOBE_HORIZONS
layout(binding = kLobeHorizonsBinding, r32ui) readonly uniform uimage2D lobeHorizons;
#endif
#endif
#if FADE
uniform float reach;
#endif

// Counting would otherwise run the shader before the stencil test
layout(early_fragment_tests) in;

layout(location = 0) out vec4 reflection;
layout(location = 1) out uint marks;

layout(std430, binding = kCountsBinding) buffer Counts { uint counts[]; };

#if FOUND
// By sample: bits of the rays that found no surface, where the only ray found one
struct Found {
  uint nothing[2];
  float at[3];
};
layout(std430, binding = kFoundBinding) writeonly buffer FoundOfSamples { Found found[]; };
#endif

// A sample and what its rays leave.
struct Surface {
  ivec2 at;
  vec3 incoming;
  vec4 normalAndG;
  bool bent;    // the normal was, as mirrored rays would go below the surface
  vec3 mirror;  // direction of the mirror ray
  vec3 position;
#if SELF
  uint object;
  vec4 rectangle;  // of the object's clusters
#endif
#if LOBES
  SampleLobe lobe;
#endif
};

// What all rays of a sample have met.
struct Met {
  vec3 sum;  // of radiance
  bool missed;
  bool sky;
  bool overEdge;
  bool itself;
  bool faded;
  bool inSecond;
};

// Follows a ray: where it ends, and the radiance `seen` there. `centre`: the ray in the centre of
// the lobe, by NEIGHBOURHOOD.
Hit follow(Surface surface, DepthImage image, Start start, vec3 direction, float limit, Hit centre,
           out vec3 seen) {
#if SELF
  vec3 own = vec3(0.0);
  float self = SELF == 2 || image.concave
                   ? meetsItself(surface.position, direction, farthest, surface.object,
                                 surface.rectangle, own)
                   : 0.0;
  limit = self > 0.0 ? min(limit, self) : limit;
#endif
#if LOBES && NEIGHBOURHOOD
  Hit hit = lookUp(image, start, direction, centre, limit);
#else
  Hit hit = walk(image, start, direction, limit);
#endif
#if SELF
  bool selfHit = self > 0.0 && hit.kind != kHit;
  hit.kind = selfHit ? kSelf : hit.kind;
#endif
#if LAYERS == 2
  image.more.x += float(hit.layer);
#endif
#if LOBES
  // An eighth of a lobe's ray is a texel of its cluster: the nearest one is enough
  seen = hit.kind == kHit ? nearestColorAt(image, hit.at) : vec3(0.0);
#else
  seen = hit.kind == kHit ? colorAt(image, hit.at, hit.height) : vec3(0.0);
#endif
#if SELF
  seen = selfHit ? own : seen;
#endif
  return hit;
}

#if LOBES && FADE
// What is not met within reach shows as much of the diffuse colour as what is met there.
void fade(float farPlane, vec3 diffuse, inout Hit hit, inout vec3 seen) {
  bool met = hit.kind == kHit || hit.kind == kSelf;
  float shown = met && hit.metres < farPlane ? 1.0 - max(hit.metres, 0.0) / farPlane : 0.0;
  seen = mix(diffuse, seen, shown);
  hit.kind = met ? hit.kind : kFaded;
}
#endif

#if LOBES
// What rays see that found nothing, and those of them over nothing. Apart from the walks: every
// lane would pay for each of them.
vec3 seenBeyond(Surface surface, vec2 shift, uvec2 nothingSeen, uvec2 skySeen) {
  vec3 sum = vec3(0.0);
  float level = lobeLevel(surface.lobe.exponent, float(RAYS));
  for (int word = 0; word < (RAYS + 31) / 32; ++word) {
    for (int cap = 0; nothingSeen[word] != 0u && cap < 32; ++cap) {
      int k = findLSB(nothingSeen[word]);
      nothingSeen[word] &= nothingSeen[word] - 1u;
      bool below;
      float weight;
      vec3 direction = lobeDirection(surface.lobe, 32 * word + k, RAYS, shift, weight, below);
      vec3 seen = (skySeen[word] >> k & 1u) != 0u
                      ? overNothing(surface.position, direction, level)
                      : fallback(surface.position, direction, level);
      sum += weight * seen;
    }
  }
  return sum;
}
#endif

// Follows all rays of a sample.
Met followRays(Surface surface, DepthImage image, inout uint bits) {
  Met all = Met(vec3(0.0), false, false, false, false, false, false);
  Start start = startAt(image, surface.position);
  float limit = farthest;
  Hit centre = Hit(kMissed, vec2(0.0), 0.0, false, 0.0, 0);
#if FOUND
  uint nothing[2] = uint[2](0u, 0u);
  vec3 where = vec3(0.0);
#endif
#if LOBES
  const int rays = RAYS;
  vec2 shift = lobeShift(surface.at);
  uvec2 nothingSeen = uvec2(0u);
  uvec2 skySeen = uvec2(0u);
#if FADE
  float g = max(roughnessOf(surface.normalAndG.a), 1e-3);
  float farPlane = reach * (1.0 - g) / g;
  limit = min(limit, farPlane);
  vec3 diffuse = imageLoad(diffuseSamples, surface.at).rgb;
#endif
#if NEIGHBOURHOOD
  centre = walk(image, start, surface.mirror, limit);
#endif
#else
  const int rays = 1;
#endif
  for (int k = 0; k < rays; ++k) {
    vec3 direction = surface.mirror;
#if LOBES
    bool below;
    float weight;
    direction = lobeDirection(surface.lobe, k, RAYS, shift, weight, below);
    below = below || surface.bent;
    if (below) atomicAdd(counts[kCountBelowHorizon], 1u);
    if (below) bits |= kMaskBelowHorizon;
#endif
    vec3 seen;
    Hit hit = follow(surface, image, start, direction, limit, centre, seen);
    all.itself = all.itself || hit.kind == kSelf;
    all.inSecond = all.inSecond || hit.layer > 0;
#if LOBES && FADE
    fade(farPlane, diffuse, hit, seen);
    all.faded = all.faded || hit.kind == kFaded;
#endif
#if LOBES
    all.sum += weight * seen;
#else
    all.sum += seen;
#endif
    all.missed = all.missed || hit.kind == kMissed;
    all.sky = all.sky || hit.kind == kSky;
    all.overEdge = all.overEdge || hit.bridged;
#if LOBES && LAMPS
    bits |= max(seen.r, max(seen.g, seen.b)) > 1.0 ? kMaskRetraced : 0u;
#endif
    uint bit = 1u << (k & 31);
#if LOBES
    nothingSeen[k >> 5] |= hit.kind == kSky || hit.kind == kMissed ? bit : 0u;
    skySeen[k >> 5] |= hit.kind == kSky ? bit : 0u;
#endif
#if FOUND
    nothing[k >> 5] |= hit.kind == kHit || hit.kind == kSelf ? 0u : bit;
    where = rays == 1 && hit.kind == kHit ? vec3(hit.at, hit.height) : vec3(0.0);
#endif
  }
#if FOUND
  found[surface.at.y * imageSize(clusterSamples).x + surface.at.x] =
      Found(nothing, float[3](where.x, where.y, where.z));
#endif
#if LOBES
  all.sum += seenBeyond(surface, shift, nothingSeen, skySeen);
#endif
  return all;
}

Surface surfaceAt(ivec2 sampleAt, vec3 ray) {
  Surface surface;
  surface.at = sampleAt;
  surface.normalAndG = imageLoad(normalSamples, sampleAt);
  surface.bent = isBent(surface.normalAndG.a);
  surface.normalAndG.a = lobeOf(surface.normalAndG.a);
  surface.incoming = normalize(ray);
  surface.mirror = normalize(reflect(surface.incoming, surface.normalAndG.xyz));
  return surface;
}

// What only samples of clusters need.
void completeSurface(vec3 ray, int cluster, inout Surface surface) {
  surface.position = positionOfSample(ray);
#if LOBES
  vec3 horizon = surface.normalAndG.xyz;
#if LOBE_HORIZONS
  horizon = lobeHorizonOf(imageLoad(lobeHorizons, surface.at).r, horizon);
#endif
  surface.lobe = sampleLobe(surface.normalAndG.a, surface.normalAndG.xyz, surface.incoming,
                            surface.mirror, horizon);
#endif
#if SELF
  surface.object = imageLoad(objectSamples, surface.at).r;
  surface.rectangle = tableOf(cluster, kRectangle);
#endif
}

void main() {
  ivec2 sampleAt = ivec2(gl_FragCoord.xy);
  uint known = imageLoad(clusterSamples, sampleAt).r;
  known = known == kTracedSample ? 0u : known;
  uint bits = 0u;
  vec3 ray = rayFromPixel * vec3(gl_FragCoord.xy, 1.0);
  Surface surface = surfaceAt(sampleAt, ray);
#if !LOBES
  bool below = surface.bent && known > 0u;
  if (below) atomicAdd(counts[kCountBelowHorizon], 1u);
  bits |= below ? kMaskBelowHorizon : 0u;
#endif
  if (known < 2u) {
    // Not a reflective one, or in no cluster
    bits |= known == 1u ? kMaskEnvironment : 0u;
    reflection = vec4(0.0, 0.0, 0.0, known == 1u ? kInCubeMap : 1.0);
  } else {
    int cluster = int(known) - 2;
    completeSurface(ray, cluster, surface);
    Met all = followRays(surface, depthImage(cluster), bits);
#if LOBES
    reflection = vec4(all.sum * (1.0 / float(RAYS)), 1.0);
#else
    reflection = vec4(all.sum, all.missed ? kInCubeMap : all.sky ? kOverNothing : 1.0);
#endif
    if (all.missed) bits |= kMaskEnvironment;
    if (all.sky) bits |= kMaskSky;
    if (all.overEdge) bits |= kMarkBridged;
    if (all.inSecond) atomicAdd(counts[kCountSecond], 1u);
    if (all.faded) atomicAdd(counts[kCountFaded], 1u);
    if (all.itself) atomicAdd(counts[kCountSelf], 1u);
  }
  marks = marksOf(reflection, bits);
}
