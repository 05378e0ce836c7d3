// Rays that meet the surface that they leave.
//   SELF  0: none is looked for; 1, 2: rays are intersected with their own object's samples
#include "samples.glsl"

#if SELF
layout(binding = kObjectsBinding, r32ui) readonly uniform uimage2D objectSamples;
const float kSelfSlack = 1e-4;  // of the depth; ours
// Of the depth, from sample to sample, at most: more is an edge. Ours.
const float kSelfStep = 0.02;

// Where the ray meets its own object's samples in the frame, metres (0: nowhere), and their diffuse
// radiance: a concave reflector [Wang2014, section 4.4], whichever clusters it is in. Steps of a
// sample, within the rectangle of the object's clusters; `farthest` metres at most.
float meetsItself(vec3 p, vec3 direction, float farthest, uint object, vec4 rectangle,
                  out vec3 radiance) {
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
