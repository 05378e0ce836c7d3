// Radiance along reflected rays by walking over clusters' depth images [Wang2014, section 3.4].
//   KIND    0 mirrored sample grids (planar mirrors), 1 one mirror ray, 2 RAYS rays of a lobe,
//           3 what the others have found nothing for, in the tiles that have a sample so marked
//   NEIGHBOURHOOD  1: of a lobe one ray is walked, the others are looked up at its distance
//   FADE    1: rays of a lobe end at `reach` (1 - g) / g metres, fading to the diffuse colour
//   SELF    1: rays of concave clusters are intersected with their own object's samples, too; 2: all
//           rays are
//   LAYERS  2: rays that pass behind what they meet look for it in a second depth layer, too
//   FOUND   1: what each ray found is written, to be compared with Embree's rays
//   BENT    1: normal maps may turn reflected rays below the surface that they leave
//   RECORD  1: instead of radiance what each walk has read, for reads.frag
#include "raster/shaders/shading.glsl"

uniform mat3 rayFromPixel;  // (sample position, 1) to a ray that advances 1 m along the axis
#if SELF || BENT
uniform mat3 pixelFromRay;  // its inverse
#endif
#if SELF
layout(binding = 6, r32ui) readonly uniform uimage2D objectSamples;
const float kSelfSlack = 1e-4;  // of the depth; ours
// Of the depth, from sample to sample, at most: more is an edge. Ours.
const float kSelfStep = 0.02;
#endif
#if FADE
uniform float reach;
#endif
#if LAYERS == 2
uniform int secondLayer;  // from an image's layer of the atlas to the one with what lies behind
#endif
uniform float nearMetres;
uniform float farthest;  // metres: no ray goes farther
uniform vec3 sceneLeast;  // corners of the scene's box, from the eye
uniform vec3 sceneMost;
uniform vec3 cubeCentre;  // of the cube map, from the eye
uniform float lastLevel;
uniform float levelOffset;  // 0.5 log2(4 / solid angle of a texel of level 0, sr)
uniform int samplesPerPixel;  // per axis
uniform vec2 sampleSize;      // 1 / samples of the frame
uniform vec2 atlasTexel;      // 1 / texels of a layer of depth images

// Images where they can be (depth cannot), not textures: llvmpipe loads from them in half the time
layout(binding = 0, r16ui) readonly uniform uimage2D clusterSamples;
layout(binding = 1, rgba32f) readonly uniform image2D normalSamples;  // xyz shading normal, a = g
layout(binding = 2) uniform sampler2D depthSamples;                   // reversed-Z
layout(binding = 3, rgba32f) readonly uniform imageBuffer clusterTable;
layout(binding = 4, rgba32f) readonly uniform image2D diffuseSamples;
layout(binding = 5, rgba16f) readonly uniform image2DArray colorImages;
layout(binding = 6) uniform sampler2DArray depthImages;
layout(binding = 7) uniform samplerCube environmentMap;

// Counting would otherwise run the shader before the stencil test
layout(early_fragment_tests) in;

layout(location = 0) out vec4 reflection;
#if KIND == 3
layout(binding = 8) uniform sampler2D reflectionSamples;  // what is written, one's own sample alone
#endif
#if KIND < 3
layout(location = 1) out uint marks;
#endif
// a of a sample that is still to be looked up, by KIND 3: in the cube map; over nothing, in a depth
// image that may have gaps; or beyond the scene
const float kInCubeMap = -1.0;
const float kOverNothing = -0.5;
const float kBeyondScene = 0.0;
const uint kMaskEnvironment = 1u;  // raster::MaskBit
const uint kMaskBelowHorizon = 16u;
const uint kMaskSky = 32u;
// Marks of this method beside those bits, counted on the CPU: of atomics llvmpipe loops over all
// lanes, of those that nobody takes, too. A ray of the sample ends over a depth edge; the sample is
// left to KIND 3.
const uint kMarkBridged = 16384u;
const uint kMarkLater = 32768u;

// What few runs have is counted here: rays, and samples with a ray.
layout(std430, binding = 1) buffer Counts { uint counts[]; };
const int kCountBelowHorizon = 0;
const int kCountSelf = 1;
const int kCountFaded = 2;
const int kCountSecond = 3;

#if FOUND
// By sample: bits of the rays that found no surface, where the only ray found one
struct Found {
  uint nothing[2];
  float at[3];
};
layout(std430, binding = 2) writeonly buffer FoundOfSamples { Found found[]; };
#endif

const int kTableTexels = 8;

struct DepthImage {
  vec4 rowX;
  vec4 rowY;
  vec4 rowZ;
  vec4 rowW;
  vec4 place;   // corner in the atlas, size
  vec4 more;    // layer; mirrored grid: right and top in the atlas, scale
  vec3 horizon; // depth infinitely far: dot(horizon, (texel, 1))
  bool crossing;
  bool concave;
};

DepthImage depthImage(int cluster) {
  int at = cluster * kTableTexels;
  DepthImage d;
  d.more = imageLoad(clusterTable, at + 5);
#if KIND != 0 || !EXACT_GRID
  d.place = imageLoad(clusterTable, at + 4);
#endif
#if KIND != 0
  d.rowX = imageLoad(clusterTable, at);
  d.rowY = imageLoad(clusterTable, at + 1);
  d.rowZ = imageLoad(clusterTable, at + 2);
  d.rowW = imageLoad(clusterTable, at + 3);
  vec4 last = imageLoad(clusterTable, at + 6);
  d.horizon = last.xyz;
  d.crossing = (int(last.w) & 1) != 0;
  d.concave = (int(last.w) & 2) != 0;
#else
  d.horizon = vec3(0.0);
  d.crossing = false;
  d.concave = false;
#endif
  return d;
}

// By its centre, the filter being nearest: of texelFetch llvmpipe makes three times as many
// instructions.
float depthAt(DepthImage image, vec2 texel) {
  vec2 at = (floor(texel) + image.place.xy + 0.5) * atlasTexel;
  return textureLod(depthImages, vec3(at, image.more.x), 0.0).r;
}
#if LAYERS == 2
float secondAt(DepthImage image, vec2 texel) {
  vec2 at = (floor(texel) + image.place.xy + 0.5) * atlasTexel;
  return textureLod(depthImages, vec3(at, image.more.x + float(secondLayer)), 0.0).r;
}
#endif
float depthOfSample(vec2 at) { return textureLod(depthSamples, at * sampleSize, 0.0).r; }

// Whether the cube map shows nothing but surfaces far around (4 x 4 texels of a face), as in a closed
// room, which the eye is in: from within a vase it shows no more.
bool closedAround(vec3 direction) {
  bool within = all(lessThan(sceneLeast, vec3(0.0))) && all(greaterThan(sceneMost, vec3(0.0)));
  return within &&
         textureLod(environmentMap, direction, max(lastLevel - 2.0, 0.0)).a > 0.999;
}
// What the cube map shows along a ray from p: the place where it leaves the scene's box, in closed
// rooms [Lagarde2012].
vec3 fallback(vec3 p, vec3 direction, float level) {
  vec3 exits = max((sceneLeast - p) / direction, (sceneMost - p) / direction);
  float t = min(exits.x, min(exits.y, exits.z));
  vec3 seen = t > 0.0 && t < 1e30 ? p + t * direction - cubeCentre : direction;
  return textureLod(environmentMap, closedAround(seen) ? seen : direction, level).rgb;
}
// What a ray over nothing leads to: beyond the scene, or in a closed room through a gap.
vec3 overNothing(vec3 p, vec3 direction, float level) {
  return closedAround(direction) ? fallback(p, direction, level) : environmentRadiance(direction);
}

// Bilinear colour over the texels that lie about as deep as the hit: edges do not bleed.
vec3 colorAt(DepthImage image, vec2 at, float depth) {
  vec2 corner = clamp(at - 0.5, vec2(0.0), image.place.zw - 1.0);
  vec2 base = min(floor(corner), max(image.place.zw - 2.0, 0.0));
  vec2 f = corner - base;
  vec2 first = base + image.place.xy;
  ivec3 origin = ivec3(ivec2(first), int(image.more.x));
  // In the order (0, 1), (1, 1), (1, 0), (0, 0)
  vec4 there = textureGather(depthImages, vec3((first + 1.0) * atlasTexel, image.more.x));
  vec4 weights = vec4(1.0 - f.x, f.x, f.x, 1.0 - f.x) * vec4(f.y, f.y, 1.0 - f.y, 1.0 - f.y);
  float near = 0.05 * (depth - dot(image.horizon, vec3(at, 1.0)));
  bvec4 asDeep = lessThanEqual(abs(there - depth), vec4(near));
  weights = max(weights, 1e-4) * mix(vec4(1e-6), vec4(1.0), asDeep);
  // Neither what nothing was drawn to nor another image's texels
  bvec2 next = greaterThan(image.place.zw, vec2(1.0));
  weights *= vec4(greaterThan(there, vec4(0.0))) * vec4(next.y, next.x && next.y, next.x, true);
  // Nothing was drawn to what has no weight: it may have an earlier frame's colour
  vec3 sum = vec3(0.0);
  const ivec2 kOffsets[4] = ivec2[4](ivec2(0, 1), ivec2(1, 1), ivec2(1, 0), ivec2(0, 0));
  for (int k = 0; k < 4; ++k) {
    vec3 color = imageLoad(colorImages, origin + ivec3(kOffsets[k], 0)).rgb;
    sum += weights[k] > 0.0 ? weights[k] * color : vec3(0.0);
  }
  float all = dot(weights, vec4(1.0));
  return all > 0.0 ? sum / all : vec3(0.0);
}

// An eighth of a lobe's ray is a texel of its cluster: the nearest one is enough. Where nothing was
// drawn the image still has an earlier frame's colour.
vec3 seenAt(DepthImage image, vec2 at, float depth) {
#if KIND == 2
  vec2 texel = clamp(at, vec2(0.0), image.place.zw - 1.0);
  ivec2 at2 = ivec2(texel) + ivec2(image.place.xy);
  vec3 color = imageLoad(colorImages, ivec3(at2, int(image.more.x))).rgb;
  return depthAt(image, texel) > 0.0 ? color : vec3(0.0);
#else
  return colorAt(image, at, depth);
#endif
}

#if KIND != 0
// What a ray was found to end at.
const int kHit = 0;
const int kSky = 1;     // it leaves the depth image over nothing
const int kMissed = 2;  // it ends behind something, or leaves the image
const int kSelf = 3;    // its own cluster
const int kFaded = 4;   // beyond its reach

// Rays that cross, or whose path is longer (texels), run far beside the camera's own: they pass
// behind what they meet at less than this share of their distance. Ours: the least error in concave
// and normal-mapped mirrors.
const float kLongPath = 48.0;
const float kThickness = 1.1;
// A ray whose cosine to the camera's axis is less may pass beside walls that the camera sees edge-on.
const float kSideways = 0.3;

struct Hit {
  int kind;
  vec2 at;      // texels
  float depth;
  bool bridged; // over a depth edge
  float metres; // along the ray
  int layer;    // of the atlas, from the image's
};

// Where all rays of a sample start.
struct Start {
  vec4 place;   // X, Y, Z, W
  vec3 from;    // texel and depth
  float before; // of the image
  float above;  // from.z above the horizon
};

Start startAt(DepthImage image, vec3 p) {
  Start start;
  start.place = vec4(dot(image.rowX, vec4(p, 1.0)), dot(image.rowY, vec4(p, 1.0)),
                     dot(image.rowZ, vec4(p, 1.0)), dot(image.rowW, vec4(p, 1.0)));
  start.from = start.place.xyz / start.place.w;
  start.before = depthAt(image, clamp(start.from.xy, vec2(0.0), image.place.zw - 1.0));
  start.above = start.from.z - dot(image.horizon, vec3(start.from.xy, 1.0));
  return start;
}

#if RECORD
// First texel + 16384 (layer, texels read), and the stride
vec4 walked = vec4(0.0);
#endif

// Walks along the unit direction in steps of a texel, to `limit` metres at most.
Hit walk(DepthImage image, Start start, vec3 direction, float limit) {
  vec4 along = vec4(dot(image.rowX.xyz, direction), dot(image.rowY.xyz, direction),
                    dot(image.rowZ.xyz, direction), dot(image.rowW.xyz, direction));
  Hit found = Hit(kMissed, vec2(0.0), 0.0, false, limit, 0);

  // As far as the frame goes: every border is a plane through the camera's eye
  vec2 size = image.place.zw;
  float t = limit;
  vec4 inside = vec4(start.place.xy, size * start.place.w - start.place.xy);
  vec4 advance = vec4(along.xy, size * along.w - along.xy);
  for (int k = 0; k < 4; ++k) {
    t = advance[k] < 0.0 ? min(t, max(inside[k], 0.0) / -advance[k]) : t;
  }
  t = along.w < 0.0 ? min(t, 0.9 * start.place.w / -along.w) : t;
  vec4 end = start.place + t * along;
  vec3 from = start.from;
  vec3 path = end.xyz / end.w - from;
  float length = max(abs(path.x), abs(path.y));
  int steps = clamp(int(ceil(length)), 1, 8192);
  vec3 stride = path / float(steps);
  bool passing = image.crossing || length > kLongPath;

  float before = start.before;
  float here = before;
  bool front = from.z >= before;
  bool hit = false;
#if LAYERS == 2
  float secondBefore = secondAt(image, clamp(from.xy, vec2(0.0), size - 1.0));
  float second = secondBefore;
  bool frontOfSecond = from.z >= second;
#endif
  int i = 0;
  while (i < steps && !hit) {
    // To the next step at which the ray goes behind the image: nothing else is done in this loop,
    // since every lane pays for it
    bool crossed = false;
#if LAYERS == 2
    bool crossedFirst = false;
    bool crossedSecond = false;
    bool wasFront = false;
#endif
    vec3 point = from + stride * float(i + 1);
    while (i < steps && !crossed) {
      before = here;
      here = depthAt(image, clamp(point.xy, vec2(0.0), size - 1.0));
      bool behind = point.z < here;
      crossed = front && behind;
#if LAYERS == 2
      secondBefore = second;
      second = secondAt(image, clamp(point.xy, vec2(0.0), size - 1.0));
      bool behindSecond = point.z < second;
      crossedFirst = crossed;
      crossedSecond = frontOfSecond && behindSecond;
      wasFront = front;
      crossed = crossedFirst || crossedSecond;
      frontOfSecond = !behindSecond;
#endif
      front = !behind;
      ++i;
      // Not where the loop begins: what is only written under the loop's mask would then wait for it
      point = from + stride * float(i + 1);
    }
    // The segments of the ray and of the image cross between the two steps
    point = from + stride * float(i);
    float horizon = dot(image.horizon, vec3(point.xy, 1.0));
    float shown = here;
    float shownBefore = before;
#if LAYERS == 2
    // A surface of the second layer may have been the first before the step
    bool nearerFirst = wasFront && abs(before - second) < abs(secondBefore - second);
    float behindOf = nearerFirst ? before : secondBefore;
    bool firstEdge = before - horizon < 0.8 * (here - horizon);
    bool secondEdge = behindOf - horizon < 0.8 * (second - horizon);
    bool inSecond = crossedSecond && !secondEdge && (!crossedFirst || firstEdge);
    shown = inSecond ? second : shown;
    shownBefore = inSecond ? behindOf : shownBefore;
#endif
    float rayBefore = from.z + stride.z * float(i - 1);
    float a = rayBefore - shownBefore;
    float b = shown - point.z;
    float s = a / max(a + b, 1e-30);
    bool edge = shownBefore - horizon < 0.8 * (shown - horizon);
    // Distances from where the ray starts, in units of its W
    float reach = start.above / (shown - horizon) - 1.0;
    bool edgeFromStart = start.above / max(shownBefore - horizon, 1e-30) - 1.0 > 1.25 * reach;
    bool passes = passing && edgeFromStart &&
                  start.above / (point.z - horizon) - 1.0 > kThickness * reach;
#if LAYERS == 2
    // What is seen behind an edge is known here: no ray ends at it that is clearly farther
    bool behindEdge = edge && point.z - horizon < (shown - horizon) / kThickness;
    passes = !inSecond && (!crossedFirst || behindEdge);
#endif
    edge = passing ? edgeFromStart : edge;
    s = edge ? 1.0 : s;
    bool taken = crossed && (!passes || !found.bridged);
#if LAYERS == 2
    taken = taken && (crossedFirst || inSecond);
    found.layer = taken ? (inSecond ? secondLayer : 0) : found.layer;
#endif
#if KIND == 2
    found.at = taken ? point.xy : found.at;  // where the image certainly shows something
#else
    found.at = taken ? mix(point.xy - stride.xy, point.xy, s) : found.at;
#endif
    found.depth = taken ? mix(shownBefore, shown, s) : found.depth;
    found.bridged = taken ? edge : found.bridged;
    float share = (float(i - 1) + s) / float(steps);
    float metres = t * share * start.place.w / mix(end.w, start.place.w, share);
    found.metres = taken ? metres : found.metres;
    hit = crossed && !passes;
  }
  // What passed behind something and found nothing ends there
  hit = hit || (found.bridged && !(front && here == 0.0));
  bool nothing = front && here == 0.0 && along.w > kSideways;
  found.kind = hit ? kHit : (nothing ? kSky : kMissed);
#if RECORD
  walked = vec4(floor(clamp(from.xy, vec2(0.0), size - 1.0)) + image.place.xy +
                    16384.0 * vec2(image.more.x, min(i, 1000) + 1),
                stride.xy);
#endif
  return found;
}
#endif

#if KIND == 2 && NEIGHBOURHOOD
// What the image shows where a ray of a lobe would be, were it as long as the one in its centre
// [Wang2014, section 4.2.2].
Hit lookUp(DepthImage image, Start start, vec3 direction, Hit centre, float limit) {
  float t = min(centre.metres, limit);
  vec4 end = start.place + t * vec4(dot(image.rowX.xyz, direction), dot(image.rowY.xyz, direction),
                                    dot(image.rowZ.xyz, direction), dot(image.rowW.xyz, direction));
  vec2 at = end.xy / max(end.w, 1e-30);
  bool inside = end.w > 0.0 && all(greaterThanEqual(at, vec2(0.0))) &&
                all(lessThan(at, image.place.zw));
  vec2 texel = clamp(at, vec2(0.0), image.place.zw - 1.0);
  float depth = depthAt(image, texel);
  int layer = 0;
#if LAYERS == 2
  // Of both layers what lies about where the ray ends
  float second = secondAt(image, texel);
  float ends = end.z / end.w;
  bool nearer = second > 0.0 && abs(second - ends) < abs(depth - ends);
  depth = nearer ? second : depth;
  layer = nearer ? secondLayer : 0;
#endif
  int kind = centre.kind == kMissed || !inside ? kMissed : depth > 0.0 ? kHit : kSky;
  return Hit(kind, at, depth, kind == kHit && centre.bridged, t, kind == kHit ? layer : 0);
}
#endif

#if SELF
// Where the ray meets its own object's samples in the frame, metres (0: nowhere), and their diffuse
// radiance: a concave reflector [Wang2014, section 4.4], whichever clusters it is in. Steps of a
// sample, within the rectangle of the object's clusters.
float meetsItself(vec3 p, vec3 direction, uint object, vec4 rectangle, out vec3 radiance) {
  radiance = vec3(0.0);
  ivec2 last = imageSize(objectSamples) - 1;
  vec3 start = pixelFromRay * p;
  vec3 along = pixelFromRay * direction;
  vec4 inside = vec4(start.xy - rectangle.xy * start.z, rectangle.zw * start.z - start.xy);
  vec4 advance = vec4(along.xy - rectangle.xy * along.z, rectangle.zw * along.z - along.xy);
  float t = farthest;
  for (int k = 0; k < 4; ++k) {
    t = advance[k] < 0.0 ? min(t, max(inside[k], 0.0) / -advance[k]) : t;
  }
  t = along.z < 0.0 ? min(t, 0.9 * start.z / -along.z) : t;
  vec3 end = start + t * along;
  // Sample position and reversed depth, which is linear along the path
  vec3 from = vec3(start.xy / start.z, nearMetres / start.z);
  vec3 path = vec3(end.xy / end.z, nearMetres / end.z) - from;
  int steps = clamp(int(ceil(max(abs(path.x), abs(path.y)))), 1, 8192);
  vec3 stride = path / float(steps);
  bool front = false;
  float before = 0.0;
  float met = 0.0;
  for (int i = 1; i <= steps && met == 0.0; ++i) {
    vec3 point = from + stride * float(i);
    ivec2 at = clamp(ivec2(point.xy), ivec2(0), last);
    float here = depthOfSample(vec2(at) + 0.5);
    // Through the surface, not behind an edge of it
    bool behind = point.z < (1.0 - kSelfSlack) * here;
    if (front && behind && abs(here - before) < kSelfStep * here &&
        imageLoad(objectSamples, at).r == object) {
      vec3 place = rayFromPixel * vec3(vec2(at) + 0.5, 1.0) * (nearMetres / here);
      met = max(dot(place - p, direction), 1e-30);
      radiance = imageLoad(diffuseSamples, at).rgb;
    }
    front = !behind;
    before = here;
  }
  return met;
}
#endif

#if BENT
// Folds a mirror ray that would leave below the shading normal's plane, as trace::lobeDirection().
vec3 foldedUp(vec3 direction, vec3 normal, out bool below) {
  float above = dot(direction, normal);
  below = above < 0.0;
  return below ? direction - 2.0 * above * normal : direction;
}
#endif

#if BENT && (KIND == 1 || KIND == 2)
// Of the triangle that the sample shows, turned to the viewer, not of unit length: depth is linear
// in the frame over a plane. Of two neighbours the one that differs less lies on it rather.
vec3 triangleNormal(vec3 incoming) {
  vec2 at = gl_FragCoord.xy;
  vec2 last = vec2(imageSize(clusterSamples)) - 1.0;
  float here = depthOfSample(at);
  vec2 before = here - vec2(depthOfSample(at - vec2(1.0, 0.0)), depthOfSample(at - vec2(0.0, 1.0)));
  vec2 after = vec2(depthOfSample(at + vec2(1.0, 0.0)), depthOfSample(at + vec2(0.0, 1.0))) - here;
  bvec2 first = lessThan(at, vec2(1.0));
  bvec2 end = greaterThan(at, last);
  bvec2 flatter = lessThan(abs(after), abs(before));
  vec2 slope = vec2(first.x || flatter.x && !end.x ? after.x : before.x,
                    first.y || flatter.y && !end.y ? after.y : before.y);
  vec3 normal = transpose(pixelFromRay) * vec3(slope, here - dot(slope, at));
  return dot(normal, incoming) > 0.0 ? -normal : normal;
}
#endif

#if KIND == 2
float radicalInverse2(uint i) {
  return float(bitfieldReverse(i) >> 8) * (1.0 / 16777216.0);
}

// Ray `index` of `RAYS` of the lobe about `mirror`, as trace::lobeDirection().
vec3 lobeDirection(vec3 mirror, vec3 normal, float exponent, int index, vec2 shift, out bool below) {
  float u = (float(index) + shift.x) / float(RAYS);
  float v = fract(radicalInverse2(uint(index)) + shift.y);
  float cosine = pow(max(1.0 - u, 1e-7), 1.0 / (exponent + 1.0));
  float sine = sqrt(max(0.0, 1.0 - cosine * cosine));
  float angle = 2.0 * kPi * v;
  float turn = mirror.z < 0.0 ? -1.0 : 1.0;
  float a = -1.0 / (turn + mirror.z);
  float b = mirror.x * mirror.y * a;
  vec3 x = vec3(1.0 + turn * mirror.x * mirror.x * a, turn * b, -turn * mirror.x);
  vec3 y = vec3(b, turn + mirror.y * mirror.y * a, -mirror.y);
  vec3 direction = normalize(sine * cos(angle) * x + sine * sin(angle) * y + cosine * mirror);
  float above = dot(direction, normal);
  below = above < 0.0;
  return below ? direction - 2.0 * above * normal : direction;
}
#endif

void main() {
  ivec2 sampleAt = ivec2(gl_FragCoord.xy);
  uint known = imageLoad(clusterSamples, sampleAt).r;
  uint bits = 0u;
  vec4 normalAndG = imageLoad(normalSamples, sampleAt);
  vec3 ray = rayFromPixel * vec3(gl_FragCoord.xy, 1.0);
  vec3 incoming = normalize(ray);
  vec3 mirror = normalize(reflect(incoming, normalAndG.xyz));
#if BENT && (KIND == 1 || KIND == 3)
  bool folded;
  mirror = foldedUp(mirror, normalAndG.xyz, folded);
#if KIND == 1
  folded = folded && known > 0u;
  if (folded) atomicAdd(counts[kCountBelowHorizon], 1u);
  bits |= folded ? kMaskBelowHorizon : 0u;
#endif
#endif
  float level = 0.0;
#if KIND >= 2
  float g2 = max(normalAndG.a, 1e-3) * max(normalAndG.a, 1e-3);
  float exponent = max(0.0, 2.0 / (g2 * g2) - 2.0);
  // Of the whole lobe, or of one of its rays
  float lobeLevel = levelOffset - 0.5 * log2(exponent + 1.0);
#if KIND == 2
  lobeLevel -= 0.5 * log2(float(RAYS));
#endif
  level = clamp(lobeLevel, 0.0, lastLevel);
#endif
#if KIND == 3
  float where = texelFetch(reflectionSamples, sampleAt, 0).a;
  if (known == 0u || where > 0.0) discard;
  vec3 position = ray * (nearMetres / max(depthOfSample(gl_FragCoord.xy), 1e-30));
  vec3 radiance = where == kInCubeMap     ? fallback(position, mirror, level)
                  : where == kOverNothing ? overNothing(position, mirror, level)
                                          : environmentRadiance(mirror);
  reflection = vec4(radiance, 1.0);
#else
  if (known < 2u) {
    // Not a reflective one, or in no cluster
    bits |= known == 1u ? kMaskEnvironment : 0u;
    reflection = vec4(0.0, 0.0, 0.0, known == 1u ? kInCubeMap : 1.0);
  } else {
    DepthImage image = depthImage(int(known) - 2);
#if KIND == 0
    // The mirrored camera has a texel for this very sample
    vec2 at = vec2(image.more.y - gl_FragCoord.x, gl_FragCoord.y - image.more.z) * image.more.w;
    ivec3 texel = ivec3(at, int(image.more.x));
    vec2 centre = (vec2(texel.xy) + 0.5) * atlasTexel;
    float there = textureLod(depthImages, vec3(centre, image.more.x), 0.0).r;
    if (there > 0.0) {
#if EXACT_GRID
      reflection = vec4(imageLoad(colorImages, texel).rgb, 1.0);
#else
      reflection = vec4(colorAt(image, at - image.place.xy, there), 1.0);
#endif
    } else {
      reflection = vec4(0.0, 0.0, 0.0, kBeyondScene);
      bits = kMaskSky;
    }
#else
    vec3 position = ray * (nearMetres / max(depthOfSample(gl_FragCoord.xy), 1e-30));
    bool missed = false;
    bool sky = false;
    bool overEdge = false;
#if LAYERS == 2
    bool inSecond = false;
    float layerOfImage = image.more.x;
#endif
    bool metItself = false;
#if BENT
    // A ray that goes below its triangle from just above it ends there
    vec3 outwards = triangleNormal(incoming);
    bool startsAbove = dot(normalAndG.xyz, outwards) > 0.0;
    vec3 ownDiffuse = imageLoad(diffuseSamples, sampleAt).rgb;
#endif
#if KIND == 1
    const int rays = 1;
#else
    const int rays = RAYS;
    int cell = (sampleAt.y % samplesPerPixel) * samplesPerPixel + sampleAt.x % samplesPerPixel;
    vec2 shift = vec2((float(cell) + 0.5) / float(samplesPerPixel * samplesPerPixel),
                      fract(float(cell) * 0.6180340));
#endif
    Start start = startAt(image, position);
    vec3 sum = vec3(0.0);
#if FOUND
    uint nothing[2] = uint[2](0u, 0u);
    vec3 where = vec3(0.0);
#endif
    float limit = farthest;
#if KIND == 2 && FADE
    float g = max(normalAndG.a, 1e-3);
    float farPlane = reach * (1.0 - g) / g;
    limit = min(limit, farPlane);
    vec3 diffuse = imageLoad(diffuseSamples, sampleAt).rgb;
    bool faded = false;
#endif
#if KIND == 2 && NEIGHBOURHOOD
    Hit centre = walk(image, start, mirror, limit);
#endif
#if KIND == 2
    uvec2 nothingSeen = uvec2(0u);
    uvec2 skySeen = uvec2(0u);
#endif
#if SELF
    uint object = imageLoad(objectSamples, sampleAt).r;
    vec4 rectangle = imageLoad(clusterTable, (int(known) - 2) * kTableTexels + 7);
#endif
    for (int k = 0; k < rays; ++k) {
      vec3 direction = mirror;
#if KIND == 2
      bool below;
      direction = lobeDirection(mirror, normalAndG.xyz, exponent, k, shift, below);
      if (below) atomicAdd(counts[kCountBelowHorizon], 1u);
      if (below) bits |= kMaskBelowHorizon;
#endif
#if SELF
      vec3 own = vec3(0.0);
      float self = SELF == 2 || image.concave
                       ? meetsItself(position, direction, object, rectangle, own)
                       : 0.0;
      float until = self > 0.0 ? min(limit, self) : limit;
#else
      float until = limit;
#endif
#if KIND == 2 && NEIGHBOURHOOD
      Hit hit = lookUp(image, start, direction, centre, until);
#else
      Hit hit = walk(image, start, direction, until);
#endif
#if SELF
      bool selfHit = self > 0.0 && hit.kind != kHit;
      hit.kind = selfHit ? kSelf : hit.kind;
#endif
#if BENT
      bool inwards = startsAbove && dot(direction, outwards) < 0.0;
      hit.kind = inwards ? kSelf : hit.kind;
      hit.bridged = hit.bridged && !inwards;
      hit.metres = inwards ? 0.0 : hit.metres;
#endif
#if LAYERS == 2
      image.more.x = layerOfImage + float(hit.layer);
      inSecond = inSecond || hit.layer > 0;
#endif
      vec3 seen = hit.kind == kHit ? seenAt(image, hit.at, hit.depth) : vec3(0.0);
#if LAYERS == 2
      image.more.x = layerOfImage;
#endif
#if SELF
      seen = selfHit ? own : seen;
      metItself = metItself || selfHit;
#endif
#if BENT
      seen = inwards ? ownDiffuse : seen;
      metItself = metItself || inwards;
#endif
#if KIND == 2 && FADE
      // What is not met within reach shows as much of the diffuse colour as what is met there
      bool met = hit.kind == kHit || hit.kind == kSelf;
      float shown = met && hit.metres < farPlane ? 1.0 - max(hit.metres, 0.0) / farPlane : 0.0;
      seen = mix(diffuse, seen, shown);
      faded = faded || !met;
      hit.kind = met ? hit.kind : kFaded;
#endif
      sum += seen;
      missed = missed || hit.kind == kMissed;
      sky = sky || hit.kind == kSky;
      overEdge = overEdge || hit.bridged;
#if KIND == 2
      uint bit = 1u << (k & 31);
      nothingSeen[k >> 5] |= hit.kind == kSky || hit.kind == kMissed ? bit : 0u;
      skySeen[k >> 5] |= hit.kind == kSky ? bit : 0u;
#endif
#if FOUND
      nothing[k >> 5] |= hit.kind == kHit || hit.kind == kSelf ? 0u : 1u << (k & 31);
      where = rays == 1 && hit.kind == kHit ? vec3(hit.at, hit.depth) : vec3(0.0);
#endif
    }
#if FOUND
    found[sampleAt.y * imageSize(clusterSamples).x + sampleAt.x] =
        Found(nothing, float[3](where.x, where.y, where.z));
#endif
#if KIND == 2
    // Apart from the walks: every lane would pay for each of them
    for (int word = 0; word < (RAYS + 31) / 32; ++word) {
      for (int cap = 0; nothingSeen[word] != 0u && cap < 32; ++cap) {
        int k = findLSB(nothingSeen[word]);
        nothingSeen[word] &= nothingSeen[word] - 1u;
        bool below;
        vec3 direction =
            lobeDirection(mirror, normalAndG.xyz, exponent, 32 * word + k, shift, below);
        sum += (skySeen[word] >> k & 1u) != 0u ? overNothing(position, direction, level) : fallback(position, direction, level);
      }
    }
#endif
    reflection = vec4(sum * (1.0 / float(rays)), 1.0);
#if KIND == 1
    reflection.a = missed ? kInCubeMap : sky ? kOverNothing : 1.0;
#endif
    if (missed) bits |= kMaskEnvironment;
    if (sky) bits |= kMaskSky;
    if (overEdge) bits |= kMarkBridged;
#if LAYERS == 2
    if (inSecond) atomicAdd(counts[kCountSecond], 1u);
#endif
#if KIND == 2 && FADE
    if (faded) atomicAdd(counts[kCountFaded], 1u);
#endif
#if SELF || BENT
    if (metItself) atomicAdd(counts[kCountSelf], 1u);
#endif
#endif
  }
  if (reflection.a <= 0.0) bits |= kMarkLater;
  marks = bits;
#endif
#if RECORD
  reflection = walked;
#endif
}
