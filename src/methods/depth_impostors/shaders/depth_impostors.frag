// Reflections from depth maps [Popescu2006, Sec. 4.3].
//   WAY        0: texel by texel, 1: the simplified line nearest to the ray's projection, 2: the two
//              nearest, and between them
//   POINTS     points of a simplified line
//   DOMAINS    directions of lines
//   REFINE     texels on either side of a place found by lines that are walked over
#include "methods/shared/impostors/shaders/impostors.glsl"
#include "methods/shared/impostors/shaders/quad.glsl"
#include "ray.glsl"
#if WAY == 0 || REFINE > 0
#include "walk.glsl"
#endif
#if WAY != 0
#include "rows.glsl"
#endif

bool meets(int texel, int way, float steepest, vec3 origin, vec3 direction, out float t,
           out vec2 uv, out float share, inout uint work) {
  share = 0.0;
#if WALLS
  if (way == kWayBox || way == kWayShared)
    return meetsBox(texel, origin, direction, t, uv, share);
#endif
  if (way != kWayDepth) return meetsQuad(texel, origin, direction, t, uv);
  Projected ray;
  t = 0.0;
  uv = vec2(0.0);
  // A reflector's own map is met from a little later on
  float begin = texelFetch(impostorTable, texel + kWalls).w;
  vec3 forward = texelFetch(impostorTable, texel + kPlane).xyz;
  if (begin > 0.0 && steepest == 0.0 && dot(forward, direction) < kSelfCosine) return false;
  if (!projected(texel, origin + begin * direction, direction, ray)) return false;
  float size = float(textureSize(impostorColors, 0).x);
  vec3 a = vec3(ray.from.xy * size, ray.from.z);
  vec3 b = vec3(ray.to.xy * size, ray.to.z);
  int layer = int(texelFetch(impostorTable, texel + kMore).x);
#if WAY == 0
  bool any;
  float along = walks(layer, int(size), a, b, 0.0, -1, steepest, any, work);
#else
  float along = searches(layer, a, b, steepest, work);
#if REFINE > 0
  if (along <= 1.0) {
    bool any;
    float exact = walks(layer, int(size), a, b, along, REFINE, steepest, any, work);
    if (exact <= 1.0 || exact >= kHidden || !any) along = exact;
  }
#endif
#endif
  bool hit = along <= 1.0;
#if VIEWS
  if (along >= kHidden) share = -1.0;
  along = along >= kHidden ? along - kHidden : along;
#endif
  uv = mix(ray.from.xy, ray.to.xy, along);
  t = begin + distanceAt(ray, along);
  return hit;
}
