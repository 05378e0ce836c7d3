// Follows a ray over the frame's depths. Reversed depth (near / distance along the axis) is linear
// along a ray in window coordinates, so that a ray is start + s * way, s from 0 to 1: x, y in
// samples, z the depth.
//   HI_Z  1: by the pyramid of nearest depths [Uludag2014]; 0: sample by sample along the longer
//         axis [McGuire2014]
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

// What the ray meets at a sample, between the depths `one` and `other`: kHit, kBackface or kOn.
// `behind`: it passed behind the surface there.
int meets(ScreenRay ray, ivec2 at, float surface, float one, float other, inout bool behind) {
  float farthest = nearMetres / max(min(one, other), 1e-30);
  float nearest = nearMetres / max(max(one, other), 1e-30);
  float metres = nearMetres / max(surface, 1e-30);
  if (!(surface > 0.0 && farthest >= metres)) return kOn;
  if (nearest > metres + thickness) {
    behind = true;
    return kOn;
  }
  bool front = dot(imageLoad(normalSamples, at).xyz, ray.direction) < 0.0;
  bool own = imageLoad(objectSamples, at).r == ray.object;
  if (front && !own) return kHit;
  // Beside the surface that it leaves, a ray is in front of it within a sample's own slope
  if (min(one, other) > surface - slopeAt(at)) return kOn;
  return front ? kHit : own ? kOn : kBackface;
}

#if HI_Z
March march(ScreenRay ray) {
  bool behind = false;
  // Along an axis that it does not move on, `inverse` is positive
  vec2 forward = mix(vec2(0.0), vec2(1.0), greaterThanEqual(ray.way.xy, vec2(0.0)));
  vec2 inverse = 1.0 / mix(ray.way.xy, vec2(1e-20), equal(ray.way.xy, vec2(0.0)));
  // A place on the border of cells belongs to the next one
  float longer = max(abs(ray.way.x), abs(ray.way.y));
  float nudge = 1e-3 / max(longer, 1e-3);
  int level = 0;
  float s = 0.0;
  bool first = true;
  for (int step = 0; step < maxSteps; ++step) {
    if (s >= ray.last) return March(behind ? kBehind : ray.leavesAs, ivec2(0));
    ivec2 sampled = min(ivec2(ray.start.xy + (first ? 0.0 : s + nudge) * ray.way.xy), ivec2(size) - 1);
    ivec2 cell = sampled >> level;
    vec2 border = (vec2(cell) + forward) * float(1 << level);
    vec2 toBorder = (border - ray.start.xy) * inverse;
    float next = min(max(min(toBorder.x, toBorder.y), s + nudge), ray.last);
    float surface = texelFetch(pyramid, cell, level).r;
    float here = ray.start.z + s * ray.way.z;
    float there = ray.start.z + next * ray.way.z;
    if (first || min(here, there) > surface) {
      s = next;
      level = first ? 0 : min(level + 1, kLevels - 1);
      first = false;
    } else if (level > 0) {
      // Receding, it is in front of all as far as the nearest surface's depth
      float reaches = ray.way.z < 0.0 ? (surface - ray.start.z) / ray.way.z : s;
      s = clamp(reaches, s, next);
      --level;
    } else {
      int met = meets(ray, sampled, surface, here, there, behind);
      if (met != kOn) return March(met, sampled);
      s = next;
    }
  }
  return March(kSteps, ivec2(0));
}
#else
March march(ScreenRay ray) {
  bool behind = false;
  float longer = max(max(abs(ray.way.x), abs(ray.way.y)), 1e-3);
  float one = stride / longer;
  for (int step = 1; step <= maxSteps; ++step) {
    float s = float(step) * one;
    if (s >= ray.last) return March(behind ? kBehind : ray.leavesAs, ivec2(0));
    ivec2 at = min(ivec2(ray.start.xy + s * ray.way.xy), ivec2(size) - 1);
    float surface = texelFetch(pyramid, at, 0).r;
    float before = ray.start.z + (s - 0.5 * one) * ray.way.z;
    float after = ray.start.z + min(s + 0.5 * one, ray.last) * ray.way.z;
    int met = meets(ray, at, surface, before, after, behind);
    if (met != kOn) return March(met, at);
  }
  return March(kSteps, ivec2(0));
}
#endif
