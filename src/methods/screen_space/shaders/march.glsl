// Follows a ray over the frame's depths. Reversed depth (near / distance along the axis) is linear
// along a ray in window coordinates, so that a ray is start + s * way, s from 0 to 1: x, y in
// samples, z the depth.
//   HI_Z  1: by the pyramid of depths [Uludag2014]; 0: from sample to sample, or in steps along the
//         longer axis, and by a binary search within a step that hits [McGuire2014]
#include "constants.glsl"

layout(binding = 0) uniform sampler2D pyramid;
layout(binding = 1, rgba32f) readonly uniform image2D normalSamples;
layout(binding = 4, r32ui) readonly uniform uimage2D objectSamples;

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

// How much the depth changes from a sample to the next.
float slopeAt(ivec2 at) {
  ivec2 last = ivec2(size) - 1;
  float x = texelFetch(pyramid, min(at + ivec2(1, 0), last), 0).r -
            texelFetch(pyramid, max(at - ivec2(1, 0), 0), 0).r;
  float y = texelFetch(pyramid, min(at + ivec2(0, 1), last), 0).r -
            texelFetch(pyramid, max(at - ivec2(0, 1), 0), 0).r;
  return 0.5 * (abs(x) + abs(y));
}

const int kOn = -1;  // the ray goes on

// What a ray meets from s = `from` to `to` at a sample that it is not in front of, nor more than `thickness`
// behind: kHit, kBackface or kOn.
int meets(ScreenRay ray, ivec2 at, float from, float to) {
  float surface = texelFetch(pyramid, at, 0).r;
  if (surface <= 0.0) return kOn;
  bool front = dot(imageLoad(normalSamples, at).xyz, ray.direction) < 0.0;
  bool own = imageLoad(objectSamples, at).r == ray.object;
  if (front && !own) return kHit;
  // Beside the surface that it leaves, a ray is in front of it within a sample's own slope
  float farthest = ray.start.z + ray.way.z * (ray.way.z < 0.0 ? to : from);
  if (farthest > surface - slopeAt(at)) return kOn;
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

// Loops end when all rays of a group of samples have left them: what a surface is, is found out beyond the loop
// over cells.
#if HI_Z
March march(ScreenRay ray) {
  Grid grid = gridOf(ray);
  bool behind = false;
  int level = 0;
  float s = leaving(ray, grid, ivec2(ray.start.xy), 0, 0.0);
  int step = 1;
  int end = kOn;
  ivec2 at = ivec2(0);
  while (end == kOn) {
    bool reached = false;
    while (!reached && s < ray.last && step < maxSteps) {
      ivec2 cell = sampleAt(ray, grid, s) >> level;
      vec2 bounds = texelFetch(pyramid, cell, level).rg;
      float next = leaving(ray, grid, cell, level, s);
      float here = ray.start.z + s * ray.way.z;
      float there = ray.start.z + next * ray.way.z;
      bool under = max(here, there) < bounds.y;
      behind = behind || under;
      bool passes = under || min(here, there) > bounds.x;
      reached = !passes && level == 0;
      // Receding, it is in front of all as far as the nearest surface's depth
      float reaches = ray.way.z < 0.0 ? clamp((bounds.x - ray.start.z) / ray.way.z, s, next) : s;
      s = passes ? next : level == 0 ? s : reaches;
      // Upwards only beyond the border of a coarser cell
      ivec2 differs = cell ^ (sampleAt(ray, grid, next) >> level);
      bool leaves = ((differs.x | differs.y) >> kLevelStep) != 0;
      level = passes ? min(leaves ? level + kLevelStep : level, kLastLevel)
                     : max(level - kLevelStep, 0);
      ++step;
    }
    if (reached) {
      at = sampleAt(ray, grid, s);
      float here = s;
      s = leaving(ray, grid, at, 0, s);
      end = meets(ray, at, here, s);
    } else {
      end = s < ray.last ? kSteps : behind ? kBehind : ray.leavesAs;
    }
  }
  return March(end, at);
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
  int end = kOn;
  ivec2 at = ivec2(0);
  while (end == kOn) {
    bool reached = false;
    while (!reached && s < ray.last && step < maxSteps) {
      ivec2 cell = sampleAt(ray, grid, strides ? s + 0.5 * one : s);
      vec2 bounds = texelFetch(pyramid, cell, 0).rg;
      float next = strides ? min(s + one, ray.last) : leaving(ray, grid, cell, 0, s);
      float here = ray.start.z + s * ray.way.z;
      float there = ray.start.z + next * ray.way.z;
      bool under = max(here, there) < bounds.y;
      behind = behind || under;
      reached = !under && min(here, there) <= bounds.x;
      s = reached ? s : next;
      ++step;
    }
    if (reached) {
      at = sampleAt(ray, grid, strides ? s + 0.5 * one : s);
      float from = s;
      float to = strides ? min(s + one, ray.last) : leaving(ray, grid, at, 0, s);
      float here = from;
      s = to;
      // Where in a longer step it reaches the surface, to a quarter of a sample
      for (float width = stride; strides && width > 0.25; width *= 0.5) {
        float middle = 0.5 * (here + to);
        ivec2 there = sampleAt(ray, grid, middle);
        bool within = ray.start.z + middle * ray.way.z <= texelFetch(pyramid, there, 0).r;
        at = within ? there : at;
        to = within ? middle : to;
        here = within ? here : middle;
      }
      end = meets(ray, at, from, s);
    } else {
      end = s < ray.last ? kSteps : behind ? kBehind : ray.leavesAs;
    }
  }
  return March(end, at);
}
#endif
