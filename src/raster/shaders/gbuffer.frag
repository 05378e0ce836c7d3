// One sample of the G-buffer.
//   BEND         1: the normal may mirror rays below the triangle, and is bent where it does
//   HIGHLIGHT_OUTPUT  1: lights show on some glossy object
//   TINT_OUTPUT  1: tints differ from place to place on some material, and are written
//   LOBE_HORIZON_OUTPUT  1: rays of some object's lobes are bounded by its triangles' normals
#include "lobe.glsl"
#include "surface.glsl"

uniform uint objectId;

layout(location = 0) out vec4 outDiffuse;
layout(location = 1) out vec4 outNormal;
layout(location = 2) out uint outObject;
#if TINT_OUTPUT
layout(location = 3) out vec4 outTint;  // of the reflection, and F90
#endif
#if HIGHLIGHT_OUTPUT
#include "highlights.glsl"
layout(location = 3 + TINT_OUTPUT) out vec4 outHighlight;
#endif
#if LOBE_HORIZON_OUTPUT
layout(location = 3 + TINT_OUTPUT + HIGHLIGHT_OUTPUT) out uint outLobeHorizon;
#endif

#if BEND
// Of the triangle, turned to the viewer: depth is linear in the window over a plane.
vec3 triangleNormal(vec3 fromEye, vec2 slope) {
  vec4 ray = frame.rayFromWindow * vec4(gl_FragCoord.xyz, 1.0);
  vec4 right = frame.rayFromWindow[0] + slope.x * frame.rayFromWindow[2];
  vec4 down = frame.rayFromWindow[1] + slope.y * frame.rayFromWindow[2];
  vec3 place = ray.xyz / ray.w;
  vec3 normal = cross(right.xyz - place * right.w, down.xyz - place * down.w);
  normal *= inversesqrt(max(dot(normal, normal), 1e-37));
  return dot(normal, fromEye) > 0.0 ? -normal : normal;
}

// frame::aboveSurface(), the same formulas.
bool aboveSurface(vec3 geometric, vec3 direction, inout vec3 normal) {
  float viewer = -dot(geometric, direction);
  float least = min(kElevationShare * viewer, kLeastElevation);
  if (!(dot(geometric, reflect(direction, normal)) < least)) return false;
  vec3 across = normal - dot(normal, geometric) * geometric;
  float length2 = dot(across, across);
  float b = max(viewer, 0.0);
  vec3 x = across / sqrt(max(length2, 1e-20));
  float a = -dot(x, direction);
  float r2 = a * a + b * b;
  float t = max(least, 0.0);
  float q = sqrt(max(r2 - t * t, 0.0));
  float cosine2 = (b * t - a * q) / max(r2, 1e-20);
  float sine2 = max(a * t + b * q, 0.0) / max(r2, 1e-20);
  float larger = sqrt(0.5 + 0.5 * min(abs(cosine2), 1.0));
  float smaller = 0.5 * sine2 / larger;
  vec3 bent = cosine2 < 0.0 ? larger * x + smaller * geometric : smaller * x + larger * geometric;
  normal = length2 > 1e-12 && r2 > 1e-20 ? normalize(bent) : geometric;
  return true;
}
#endif

#if NORMAL_MAP
// frame::scatterPlace()
vec2 scatterPlace(uvec2 at) {
  uvec2 bits = at.x * uvec2(0xC13FA9A9u, 0x91E10DA5u) + at.y * uvec2(0x91E10DA5u, 0xC13FA9A9u);
  return vec2(bits >> 8) * (1.0 / 16777216.0);
}

// The normal of the reflection: frame::shadeSurface()
vec3 reflectionNormal(vec3 fromEye) {
  vec3 normal = interpolatedNormal();
  float footprint2 = coneFootprint2(frame.eye, fromEye, max(dot(fromEye, fromEye), 1e-20), normal);
  float level = slotLevel(material.normalSlot, footprint2);
  vec2 offset = (scatterPlace(uvec2(gl_FragCoord.xy)) - 0.5) * (exp2(level) - 1.0);
  normal = mappedNormal(normal, max(level - kFinerLevels, 0.0), offset);
  return gl_FrontFacing ? normal : -normal;
}
#endif

void main() {
#if BEND
  vec2 slope = vec2(dFdx(gl_FragCoord.z), dFdy(gl_FragCoord.z));
#endif
  cutOut();
  Surface surface = surfaceSeen();
  float alpha = surface.lobe;
#if NORMAL_MAP
  if (surface.s > 0.0) surface.normal = reflectionNormal(fragmentFromEye());
#endif
#if BEND
  vec3 fromEye = fragmentFromEye();
  vec3 geometric = triangleNormal(fromEye, slope);
  bool bent = surface.s > 0.0 && aboveSurface(geometric, normalize(fromEye), surface.normal);
  alpha = bent ? -1.0 - surface.lobe : surface.lobe;
  vec3 horizon = geometric;
#else
  vec3 horizon = surface.normal;
#endif
  outDiffuse = vec4(surface.radiance, surface.s);
  outNormal = vec4(surface.normal, alpha);
  outObject = objectId;
#if HIGHLIGHT_OUTPUT || LOBE_HORIZON_OUTPUT
  bool lobe = surface.s > 0.0 && !isMirrorLobe(surface.lobe);
#endif
#if HIGHLIGHT_OUTPUT
  vec3 away = fragmentFromEye();
  outHighlight = vec4(lobe ? lightHighlights(frame.eye.xyz + away, surface.normal, horizon,
                                             normalize(away), surface.lobe)
                           : vec3(0.0),
                      1.0);
#endif
#if LOBE_HORIZON_OUTPUT
  outLobeHorizon = BEND == 1 && lobe ? packedLobeHorizon(horizon) : 0u;
#endif
#if TINT_OUTPUT
  outTint = surface.tint;
#endif
}
