// Follows a ray over the frame's depths. Reversed depth (near / distance along the axis) is linear
// along a ray in window coordinates, so that a ray is start + s * way, s from 0 to 1: x, y in
// samples, z the depth.
//   HI_Z    1: by the pyramid of depths [Uludag2014]; 0: from sample to sample, or in steps along
//           the longer axis, and by a binary search within a step that hits [McGuire2014]
//   LAYERS  2: there is a second layer of surfaces, behind the frame's own [Mara2016]
#include "constants.glsl"

layout(binding = 0) uniform sampler2D pyramid;
layout(binding = 1, rgba32f) readonly uniform image2D normalSamples;
layout(binding = 4, r32ui) readonly uniform uimage2D objectSamples;
#if LAYERS == 2
layout(binding = 7, rg32ui) readonly uniform uimage2D secondSurfaces;  // object, packed normal
#endif

uniform vec2 size;         // of the frame, in samples
uniform vec2 focal;        // samples per unit of the tangent, x to the right, y downwards
uniform float nearMetres;
uniform mat3 eyeFromWorld;  // rows: right, down, forward
uniform float thickness;    // metres
uniform int maxSteps;
uniform float stride;  // samples

struct March {
  int end;   // kHit, ...
  ivec2 at;  // sample of the hit
  int layer;  // of the hit: 0, or 1 for the second layer
};

struct ScreenRay {
  vec3 start;
  vec3 way;
  float last;     // s where it leaves the frame
  int leavesAs;   // why it ends there
  vec3 direction;  // world space
  uint object;     // that it leaves
};

vec3 windowOf(vec3 place) {
  return vec3(0.5 * size + focal * place.xy / place.z, nearMetres / place.z);
}

// place, direction: from the eye, along right, down, forward.
ScreenRay screenRay(vec3 place, vec3 direction, vec3 worldDirection, uint object) {
  ScreenRay ray;
  ray.direction = worldDirection;
  ray.object = object;
  ray.start = windowOf(place);
  bool away = direction.z > 1e-6;
  // Towards the eye: as far as the near plane, or, along the frame, as far as matters
  float metres = direction.z < -1e-6 ? (place.z - nearMetres) / -direction.z : 1e6 * place.z;
  vec3 end = away ? vec3(0.5 * size + focal * direction.xy / direction.z, 0.0)
                  : windowOf(place + metres * direction);
  ray.way = end - ray.start;
  vec2 edge = mix(vec2(0.0), size, greaterThan(ray.way.xy, vec2(0.0)));
  vec2 leaves = (edge - ray.start.xy) / ray.way.xy;
  float leave = min(ray.way.x != 0.0 ? leaves.x : 2.0, ray.way.y != 0.0 ? leaves.y : 2.0);
  ray.last = min(leave, 1.0);
  ray.leavesAs = leave < 1.0 ? kOffscreen : away ? kSky : kTowardCamera;
  return ray;
}

// Depth of the surface that a layer has at a sample; 0: none.
float depthAt(ivec2 at, int layer) {
#if LAYERS == 2
  vec4 bounds = texelFetch(pyramid, at, 0);
  return layer == 1 ? bounds.z : bounds.x;
#else
  return texelFetch(pyramid, at, 0).r;
#endif
}

// How much the depth changes from a sample to the next.
float slopeAt(ivec2 at, int layer) {
  ivec2 last = ivec2(size) - 1;
  float x = depthAt(min(at + ivec2(1, 0), last), layer) - depthAt(max(at - ivec2(1, 0), 0), layer);
  float y = depthAt(min(at + ivec2(0, 1), last), layer) - depthAt(max(at - ivec2(0, 1), 0), layer);
  return 0.5 * (abs(x) + abs(y));
}

const int kOn = -1;  // the ray goes on

// What a ray meets from s = `from` to `to` at a sample whose surface in `layer` it is not in front of, nor more
// than `thickness` behind: kHit, kBackface or kOn.
int meets(ScreenRay ray, ivec2 at, int layer, float from, float to) {
  float surface = depthAt(at, layer);
  if (surface <= 0.0) return kOn;
#if LAYERS == 2
  uvec2 second = imageLoad(secondSurfaces, at).xy;
  vec3 normal = layer == 1 ? lobeHorizonOf(second.y, vec3(0.0)) : imageLoad(normalSamples, at).xyz;
  uint object = layer == 1 ? second.x : imageLoad(objectSamples, at).r;
#else
  vec3 normal = imageLoad(normalSamples, at).xyz;
  uint object = imageLoad(objectSamples, at).r;
#endif
  bool front = dot(normal, ray.direction) < 0.0;
  bool own = object == ray.object;
  if (front && !own) return kHit;
  // Beside the surface that it leaves, a ray is in front of it within a sample's own slope
  float farthest = ray.start.z + ray.way.z * (ray.way.z < 0.0 ? to : from);
  if (farthest > surface - slopeAt(at, layer)) return kOn;
  return front ? kHit : own ? kOn : kBackface;
}

// How a ray crosses cells of samples.
struct Grid {
  vec2 forward;
  vec2 inverse;
  float nudge;  // a place on the border of cells belongs to the next one
};

ivec2 sampleAt(ScreenRay ray, Grid grid, float s) {
  return min(ivec2(ray.start.xy + (s + grid.nudge) * ray.way.xy), ivec2(size) - 1);
}

// Where it leaves the cell.
float leaving(ScreenRay ray, Grid grid, ivec2 cell, int level, float s) {
  vec2 border = (vec2(cell) + grid.forward) * float(1 << level);
  vec2 leaves = (border - ray.start.xy) * grid.inverse;
  return min(max(min(leaves.x, leaves.y), s + grid.nudge), ray.last);
}

Grid gridOf(ScreenRay ray) {
  Grid grid;
  grid.forward = mix(vec2(0.0), vec2(1.0), greaterThanEqual(ray.way.xy, vec2(0.0)));
  // Along an axis that it does not move on, it is positive
  grid.inverse = 1.0 / mix(ray.way.xy, vec2(1e-20), equal(ray.way.xy, vec2(0.0)));
  grid.nudge = 1e-3 / max(max(abs(ray.way.x), abs(ray.way.y)), 1e-3);
  return grid;
}

// Whether nothing of a cell is met between two depths of the ray: it is behind or in front of all surfaces.
// under: behind those of the first layer.
#if LAYERS == 2
#define Bounds vec4
bool passesBy(vec4 bounds, float here, float there, out bool under) {
  float nearest = max(here, there);
  float farthest = min(here, there);
  under = nearest < bounds.y;
  return (under || farthest > bounds.x) && (nearest < bounds.w || farthest > bounds.z);
}
#else
#define Bounds vec2
bool passesBy(vec2 bounds, float here, float there, out bool under) {
  under = max(here, there) < bounds.y;
  return under || min(here, there) > bounds.x;
}
#endif

#if HI_Z
ivec2 refined(ScreenRay ray, Grid grid, ivec2 at, int layer, float from, float to) { return at; }
#else
// Where in a longer step it reaches the surface, to a quarter of a sample.
ivec2 refined(ScreenRay ray, Grid grid, ivec2 at, int layer, float from, float to) {
  for (float width = stride; stride > 1.0 && width > 0.25; width *= 0.5) {
    float middle = 0.5 * (from + to);
    ivec2 there = sampleAt(ray, grid, middle);
    bool within = ray.start.z + middle * ray.way.z <= depthAt(there, layer);
    at = within ? there : at;
    to = within ? middle : to;
    from = within ? from : middle;
  }
  return at;
}
#endif

// What a ray meets from s = `from` to `to` at a sample that it does not pass by.
#if LAYERS == 2
March meetsAny(ScreenRay ray, Grid grid, ivec2 at, float from, float to) {
  vec4 bounds = texelFetch(pyramid, at, 0);
  float here = ray.start.z + from * ray.way.z;
  float there = ray.start.z + to * ray.way.z;
  float nearest = max(here, there);
  float farthest = min(here, there);
  bool first = nearest >= bounds.y && farthest <= bounds.x;
  bool second = nearest >= bounds.w && farthest <= bounds.z;
  // Behind the first layer throughout, it reaches a surface, while the first one's thickness is assumed
  int layer = second && (!first || nearest < bounds.x) ? 1 : 0;
  March found = March(kOn, at, layer);
  for (int i = 0; i < 2 && found.end == kOn; ++i) {
    found.layer = i == 0 ? layer : 1 - layer;
    if (found.layer == 1 ? second : first) {
      found.at = refined(ray, grid, at, found.layer, from, to);
      found.end = meets(ray, found.at, found.layer, from, to);
    }
  }
  return found;
}
#else
March meetsAny(ScreenRay ray, Grid grid, ivec2 at, float from, float to) {
  ivec2 place = refined(ray, grid, at, 0, from, to);
  return March(meets(ray, place, 0, from, to), place, 0);
}
#endif

// Loops end when all rays of a group of samples have left them: what a surface is, is found out beyond the loop
// over cells.
#if HI_Z
March march(ScreenRay ray) {
  Grid grid = gridOf(ray);
  bool behind = false;
  int level = 0;
  float s = leaving(ray, grid, ivec2(ray.start.xy), 0, 0.0);
  int step = 1;
  March found = March(kOn, ivec2(0), 0);
  while (found.end == kOn) {
    bool reached = false;
    while (!reached && s < ray.last && step < maxSteps) {
      ivec2 cell = sampleAt(ray, grid, s) >> level;
      Bounds bounds = Bounds(texelFetch(pyramid, cell, level));
      float next = leaving(ray, grid, cell, level, s);
      float here = ray.start.z + s * ray.way.z;
      float there = ray.start.z + next * ray.way.z;
      bool under;
      bool passes = passesBy(bounds, here, there, under);
      behind = behind || under;
      reached = !passes && level == 0;
      // Receding, it is in front of all as far as the nearest surface's depth
#if LAYERS == 2
      float nearest = under ? bounds.z : bounds.x;
#else
      float nearest = bounds.x;
#endif
      float reaches = ray.way.z < 0.0 ? clamp((nearest - ray.start.z) / ray.way.z, s, next) : s;
      s = passes ? next : level == 0 ? s : reaches;
      // Upwards only beyond the border of a coarser cell
      ivec2 differs = cell ^ (sampleAt(ray, grid, next) >> level);
      bool leaves = ((differs.x | differs.y) >> kLevelStep) != 0;
      level = passes ? min(leaves ? level + kLevelStep : level, kLastLevel)
                     : max(level - kLevelStep, 0);
      ++step;
    }
    if (reached) {
      ivec2 at = sampleAt(ray, grid, s);
      float here = s;
      s = leaving(ray, grid, at, 0, s);
      found = meetsAny(ray, grid, at, here, s);
    } else {
      found.end = s < ray.last ? kSteps : behind ? kBehind : ray.leavesAs;
    }
  }
  return found;
}
#else
March march(ScreenRay ray) {
  Grid grid = gridOf(ray);
  // With a stride of 1 every sample that the ray crosses is tested, otherwise the one amid each step
  bool strides = stride > 1.0;
  float one = stride / max(max(abs(ray.way.x), abs(ray.way.y)), 1e-3);
  bool behind = false;
  float s = strides ? 0.5 * one : leaving(ray, grid, ivec2(ray.start.xy), 0, 0.0);
  int step = 1;
  March found = March(kOn, ivec2(0), 0);
  while (found.end == kOn) {
    bool reached = false;
    while (!reached && s < ray.last && step < maxSteps) {
      ivec2 cell = sampleAt(ray, grid, strides ? s + 0.5 * one : s);
      Bounds bounds = Bounds(texelFetch(pyramid, cell, 0));
      float next = strides ? min(s + one, ray.last) : leaving(ray, grid, cell, 0, s);
      float here = ray.start.z + s * ray.way.z;
      float there = ray.start.z + next * ray.way.z;
      bool under;
      reached = !passesBy(bounds, here, there, under);
      behind = behind || under;
      s = reached ? s : next;
      ++step;
    }
    if (reached) {
      ivec2 at = sampleAt(ray, grid, strides ? s + 0.5 * one : s);
      float from = s;
      s = strides ? min(s + one, ray.last) : leaving(ray, grid, at, 0, s);
      found = meetsAny(ray, grid, at, from, s);
    } else {
      found.end = s < ray.last ? kSteps : behind ? kBehind : ray.leavesAs;
    }
  }
  return found;
}
#endif
