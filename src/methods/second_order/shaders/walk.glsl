// The walk of a ray over its cluster's depth image [Wang2014, section 3.4], texel by texel.
//   LAYERS  2: rays that pass behind what they meet look for it in a second depth layer, too
//   LOBES   1: colours are of the nearest texel, which must be one that the image certainly shows
#include "depth_image.glsl"

uniform float farthest;  // metres: no ray goes farther

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
  float height; // above the image's horizon
  bool bridged; // over a depth edge
  float metres; // along the ray
  int layer;    // of the atlas, from the image's
};

// Where all rays of a sample start.
struct Start {
  vec3 place;   // X, Y, W
  vec3 from;    // texel and height above the horizon
  float before; // of the image
};

Start startAt(DepthImage image, vec3 p) {
  Start start;
  start.place = vec3(dot(image.rowX, vec4(p, 1.0)), dot(image.rowY, vec4(p, 1.0)),
                     dot(image.rowW, vec4(p, 1.0)));
  start.from = vec3(start.place.xy, image.horizon.w) / start.place.z;
  start.before = heightAt(image, clamp(start.from.xy, vec2(0.0), image.place.zw - 1.0));
  return start;
}

// A ray's way over the image, in steps of a texel.
struct Path {
  float alongW;  // advance of W per metre
  float metres;
  vec3 end;      // X, Y, W
  int steps;
  vec3 stride;   // texel and height above the horizon
  bool passing;  // the ray may pass behind what it meets
};

Path pathOf(DepthImage image, Start start, vec3 direction, float limit) {
  vec3 along = vec3(dot(image.rowX.xyz, direction), dot(image.rowY.xyz, direction),
                    dot(image.rowW.xyz, direction));
  // As far as the frame goes: every border is a plane through the camera's eye
  vec2 size = image.place.zw;
  float t = limit;
  vec4 inside = vec4(start.place.xy, size * start.place.z - start.place.xy);
  vec4 advance = vec4(along.xy, size * along.z - along.xy);
  for (int k = 0; k < 4; ++k) {
    t = advance[k] < 0.0 ? min(t, max(inside[k], 0.0) / -advance[k]) : t;
  }
  t = along.z < 0.0 ? min(t, 0.9 * start.place.z / -along.z) : t;
  Path path;
  path.alongW = along.z;
  path.metres = t;
  path.end = start.place + t * along;
  vec3 way = vec3(path.end.xy, image.horizon.w) / path.end.z - start.from;
  float length = max(abs(way.x), abs(way.y));
  path.steps = clamp(int(ceil(length)), 1, 8192);
  path.stride = way / float(path.steps);
  path.passing = image.crossing || length > kLongPath;
  return path;
}

// Heights of the image above its horizon at the last two steps, and where the ray was.
struct Heights {
  float before;
  float here;
  bool front;    // of the image, at the last step
  bool crossed;  // the ray has gone behind the image with the last step
#if LAYERS == 2
  float secondBefore;
  float second;
  bool wasFront;
  bool frontOfSecond;
  bool crossedFirst;
  bool crossedSecond;
#endif
};

Heights heightsAtStart(DepthImage image, Start start) {
  Heights d;
  d.before = start.before;
  d.here = d.before;
  d.front = start.from.z >= d.before;
#if LAYERS == 2
  d.secondBefore = secondAt(image, clamp(start.from.xy, vec2(0.0), image.place.zw - 1.0));
  d.second = d.secondBefore;
  d.frontOfSecond = start.from.z >= d.second;
#endif
  return d;
}

void takeStep(DepthImage image, vec3 point, inout Heights d) {
  vec2 size = image.place.zw;
  d.before = d.here;
  d.here = heightAt(image, clamp(point.xy, vec2(0.0), size - 1.0));
  bool behind = point.z < d.here;
  d.crossed = d.front && behind;
#if LAYERS == 2
  d.secondBefore = d.second;
  d.second = secondAt(image, clamp(point.xy, vec2(0.0), size - 1.0));
  bool behindSecond = point.z < d.second;
  d.crossedFirst = d.crossed;
  d.crossedSecond = d.frontOfSecond && behindSecond;
  d.wasFront = d.front;
  d.crossed = d.crossedFirst || d.crossedSecond;
  d.frontOfSecond = !behindSecond;
#endif
  d.front = !behind;
}

// Where the segments of the ray and of the image cross between two steps.
struct Crossing {
  float shown;        // by the image, at the step
  float shownBefore;
  float share;        // of the step
  bool edge;
  bool passes;        // the ray passes behind
  bool inSecond;      // of the two layers
};

Crossing crossingAt(DepthImage image, Start start, Path path, vec3 point, float rayBefore, Heights d) {
  Crossing c;
  c.inSecond = false;
  c.shown = d.here;
  c.shownBefore = d.before;
#if LAYERS == 2
  // A surface of the second layer may have been the first before the step
  bool nearerFirst = d.wasFront && abs(d.before - d.second) < abs(d.secondBefore - d.second);
  float behindOf = nearerFirst ? d.before : d.secondBefore;
  bool firstEdge = d.before < 0.8 * d.here;
  bool secondEdge = behindOf < 0.8 * d.second;
  c.inSecond = d.crossedSecond && !secondEdge && (!d.crossedFirst || firstEdge);
  c.shown = c.inSecond ? d.second : c.shown;
  c.shownBefore = c.inSecond ? behindOf : c.shownBefore;
#endif
  float a = rayBefore - c.shownBefore;
  float b = c.shown - point.z;
  float s = a / max(a + b, 1e-30);
  bool edge = c.shownBefore < 0.8 * c.shown;
  // Distances from where the ray starts, in units of its W
  float reach = start.from.z / c.shown - 1.0;
  bool edgeFromStart = start.from.z / max(c.shownBefore, 1e-30) - 1.0 > 1.25 * reach;
  c.passes = path.passing && edgeFromStart &&
             start.from.z / point.z - 1.0 > kThickness * reach;
#if LAYERS == 2
  // What is seen behind an edge is known here: no ray ends at it that is clearly farther
  bool behindEdge = edge && point.z < c.shown / kThickness;
  c.passes = !c.inSecond && (!d.crossedFirst || behindEdge);
#endif
  c.edge = path.passing ? edgeFromStart : edge;
  c.share = c.edge ? 1.0 : s;
  return c;
}

// Walks along the unit direction, to `limit` metres at most.
Hit walk(DepthImage image, Start start, vec3 direction, float limit) {
  Hit found = Hit(kMissed, vec2(0.0), 0.0, false, limit, 0);
  Path path = pathOf(image, start, direction, limit);
  vec3 from = start.from;
  vec3 stride = path.stride;
  Heights d = heightsAtStart(image, start);
  bool hit = false;
  int i = 0;
  while (i < path.steps && !hit) {
    // To the next step at which the ray goes behind the image: nothing else is done in this loop,
    // since every lane pays for it
    d.crossed = false;
#if LAYERS == 2
    d.crossedFirst = false;
    d.crossedSecond = false;
    d.wasFront = false;
#endif
    vec3 point = from + stride * float(i + 1);
    while (i < path.steps && !d.crossed) {
      takeStep(image, point, d);
      ++i;
      // Not where the loop begins: what is only written under the loop's mask would then wait for it
      point = from + stride * float(i + 1);
    }
    point = from + stride * float(i);
    float rayBefore = from.z + stride.z * float(i - 1);
    Crossing c = crossingAt(image, start, path, point, rayBefore, d);
    bool taken = d.crossed && (!c.passes || !found.bridged);
#if LAYERS == 2
    taken = taken && (d.crossedFirst || c.inSecond);
    found.layer = taken ? (c.inSecond ? secondLayer : 0) : found.layer;
#endif
#if LOBES
    found.at = taken ? point.xy : found.at;
#else
    found.at = taken ? mix(point.xy - stride.xy, point.xy, c.share) : found.at;
#endif
    found.height = taken ? mix(c.shownBefore, c.shown, c.share) : found.height;
    found.bridged = taken ? c.edge : found.bridged;
    float share = (float(i - 1) + c.share) / float(path.steps);
    float metres = path.metres * share * start.place.z / mix(path.end.z, start.place.z, share);
    found.metres = taken ? metres : found.metres;
    hit = d.crossed && !c.passes;
  }
  // What passed behind something and found nothing ends there
  hit = hit || (found.bridged && !(d.front && d.here == 0.0));
  bool nothing = d.front && d.here == 0.0 && path.alongW > kSideways;
  found.kind = hit ? kHit : (nothing ? kSky : kMissed);
  return found;
}
