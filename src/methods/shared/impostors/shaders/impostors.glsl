// Radiance along the reflected rays of samples, from the impostors of their reflector and from the
// environment map behind. An entry point includes this file and defines
//   bool meets(int texel, int way, float steepest, vec3 origin, vec3 direction, out float t,
//              out vec2 uv, out float share, inout uint work)
// for an impostor whose lines of the table begin at `texel`; steepest: MapRays::steepest; share: of the
// environment map's radiance, or -1 where the impostor hides from `t` on what the ray meets.
//   GLOSSY   1: rays of a lobe, each a cone of its share
//   VIEWS    1: objects may have several depth maps for a reflector
//   BOUNCES  2: rays that hit a reflective impostor go on
//   MASKS    1: marks are written as masks, too
//   WALLS    1: there are transition walls
//   FADES    1: what is far off is dimmed
#include "constants.glsl"
#include "methods/shared/shaders/lobe_rays.glsl"
#include "raster/shaders/masks.glsl"

layout(binding = kSampleNormalsUnit) uniform sampler2D normalSamples;  // xyz normal, a = g (lobe.glsl)
layout(binding = kSampleDepthsUnit) uniform sampler2D depthSamples;    // reversed-Z
layout(binding = kSampleObjectsUnit) uniform usampler2D objectSamples;
layout(binding = kTableUnit) uniform samplerBuffer impostorTable;
layout(binding = kListsUnit) uniform isamplerBuffer impostorLists;  // by object: first (-1 - first: it is traced), diffuse, all
layout(binding = kColorsUnit) uniform sampler2DArray impostorColors;
layout(binding = kPlaneColorsUnit) uniform sampler2DArray planeColors;  // of objects' own planes
#if BOUNCES > 1
layout(binding = kNormalsUnit) uniform sampler2DArray impostorNormals;
layout(binding = kPlaneNormalsUnit) uniform sampler2DArray planeNormals;
uniform bool secondDiffuse;
#endif
layout(binding = kCubeMapUnit) uniform samplerCube environmentMap;

uniform mat3 rayFromSample;  // (sample position, 1) to a ray that advances 1 m along the axis
uniform vec3 eye;
uniform float nearMetres;
uniform float spreadRad;
uniform float levelOffset;  // 0.5 log2(4 / solid angle of a texel of level 0, sr)
uniform float lastLevel;
uniform vec3 sceneLeast;  // corners of the scene's box
uniform vec3 sceneMost;
uniform vec3 cubeCentre;
#if FADES
uniform float fadeMetres;
uniform float skyKept;  // what is left of the environment
#endif

layout(location = 0) out vec4 reflection;
layout(location = 1) out uint known;
#if MASKS
layout(location = 2) out uint mask;
#endif

// Coverage from which a texel shows its object.
const float kCovered = 0.5;
#if GLOSSY
// Edges of a box as wide as a cone's footprint in all, over the look-up's texels: sqrt(12) / 2
const float kFootprint = 1.7320508;
const int kBehind = 3;  // impostors behind the nearest that share a cone
#endif

bool meets(int texel, int way, float steepest, vec3 origin, vec3 direction, out float t,
           out vec2 uv, out float share, inout uint work);

struct Found {
  float t;
  int impostor;  // -1: none
  vec4 color;    // radiance times coverage, coverage
  vec2 uv;
  float level;
  float share;  // of the environment map
  int way;
#if VIEWS
  float hidden;  // from where on no map of an object sees the ray
#endif
#if GLOSSY
  vec4 behind[kBehind];  // colors of the next impostors
  float tBehind[kBehind];
#endif
};

// What the environment map shows along a ray: where surfaces are all around (4 x 4 texels of a
// face), at the place where the ray leaves the scene's box [Lagarde2012].
vec3 environmentAlong(vec3 origin, vec3 direction, float level) {
  vec3 leaves = max((sceneLeast - origin) / direction, (sceneMost - origin) / direction);
  float t = min(leaves.x, min(leaves.y, leaves.z));
  vec3 place = t > 0.0 && t < 1e30 ? origin + t * direction - cubeCentre : direction;
  bool closed = textureLod(environmentMap, place, max(lastLevel - 2.0, 0.0)).a > 0.999;
  vec3 seen = textureLod(environmentMap, closed ? place : direction, level).rgb;
#if FADES
  seen *= closed ? exp(-t / fadeMetres) : skyKept;
#endif
  return seen;
}

// What an impostor shows at a place of its image, coverage 1 on its object's.
vec4 shownAt(vec3 place, float level, int way) {
  bool isDepth = way == kWayDepth;
  bool isPlane = way == kWayPlane || way == kWayBox;
#if GLOSSY
  // The part of a look-up that falls on the image: beside it there is nothing
  vec2 size = vec2(isPlane ? textureSize(planeColors, 0).xy : textureSize(impostorColors, 0).xy);
  vec2 across = exp2(level) * kFootprint / size;
  vec2 least = clamp(place.xy - 0.5 * across, 0.0, 1.0);
  vec2 most = clamp(place.xy + 0.5 * across, 0.0, 1.0);
  vec2 share = isDepth ? vec2(1.0) : (most - least) / across;
  if (!(share.x * share.y > 0.0)) return vec4(0.0);
  if (!isDepth) place.xy = 0.5 * (least + most);
  level = max(0.0, level + 0.5 * log2(share.x * share.y));
#endif
  vec4 color = isPlane ? textureLod(planeColors, place, level)
                       : textureLod(impostorColors, place, level);
#if GLOSSY
  if (!isDepth) return color * (share.x * share.y);
#endif
  // A depth map knows what is hit; over its outline look at what is beside
  if (isDepth && color.a < kCovered) color = textureLod(impostorColors, place, level + 2.0);
  bool covered = isDepth ? color.a > 1e-3 : color.a >= kCovered;
  return covered ? vec4(color.rgb / color.a, 1.0) : vec4(0.0);
}

#if VIEWS
// Several depth maps of an object, listed from `first` on: the ray asks the one that it faces most, and
// the next one where that hides it. share: -1 where all do, from t on.
bool meetsViews(int first, int views, vec3 origin, vec3 direction, out int impostor, out float t,
                out vec2 uv, out float share, inout uint work) {
  const int indexBits = (1 << kViewsShift) - 1;
  uint asked = 0u;
  float hidden = 1e30;
  for (int round = 0; round < views; ++round) {
    float best = -2.0;
    int next = 0;
    for (int v = 0; v < views; ++v) {
      int index = texelFetch(impostorLists, first + v).r & indexBits;
      float facing = dot(texelFetch(impostorTable, index * kTableTexels + kPlane).xyz, direction);
      if ((asked >> v & 1u) != 0u || !(facing > best)) continue;
      best = facing;
      next = v;
      impostor = index;
    }
    asked |= 1u << next;
    int texel = impostor * kTableTexels;
    float steepest = texelFetch(impostorTable, texel + kTint).w;
    bool hit = meets(texel, kWayDepth, steepest, origin, direction, t, uv, share, work);
    if (hit || share >= 0.0) return hit;
    hidden = min(hidden, t);
  }
  t = hidden;
  return false;
}
#endif

Found nothingFound() {
  Found found;
  found.t = 1e30;
  found.impostor = -1;
  found.color = vec4(0.0);
  found.share = 0.0;
  found.way = kWayQuad;
#if VIEWS
  found.hidden = 1e30;
#endif
#if GLOSSY
  for (int k = 0; k < kBehind; ++k) found.tBehind[k] = 1e30;
#endif
  return found;
}

#if GLOSSY
// Keeps a hit among the nearest: the new one takes its place, what it displaces the next.
void keepBehind(bool first, float t, vec4 color, inout Found found) {
  vec4 moved = first ? found.color : color;
  float tMoved = first ? found.t : t;
  for (int k = 0; k < kBehind; ++k) {
    if (tMoved >= found.tBehind[k]) continue;
    vec4 next = found.behind[k];
    float tNext = found.tBehind[k];
    found.behind[k] = moved;
    found.tBehind[k] = tMoved;
    moved = next;
    tMoved = tNext;
  }
}
#endif

// The nearest of an object's impostors along a ray; `distance`: from the eye to its origin.
Found nearest(int object, bool diffuseAlone, vec3 origin, vec3 direction, float distance,
              float spread, inout uint work, inout uint marks) {
  Found found = nothingFound();
  int first = texelFetch(impostorLists, 3 * object).r;
  first = first < 0 ? -1 - first : first;
  int count = texelFetch(impostorLists, 3 * object + (diffuseAlone ? 1 : 2)).r;
  for (int i = 0; i < 4096; ++i) {
    if (i >= count) break;
    int impostor = texelFetch(impostorLists, first + i).r;
    float t;
    vec2 uv;
    float share;
#if VIEWS
    int views = impostor >> kViewsShift;
    bool hit = false;
    if (views > 0) {
      hit = meetsViews(first + i, views, origin, direction, impostor, t, uv, share, work);
      if (!hit && share < 0.0) found.hidden = min(found.hidden, t);
      i += views - 1;
    }
    int texel = impostor * kTableTexels;
    vec4 more = texelFetch(impostorTable, texel + kMore);
    if (views == 0) hit = meets(texel, int(more.y), 0.0, origin, direction, t, uv, share, work);
#else
    int texel = impostor * kTableTexels;
    vec4 more = texelFetch(impostorTable, texel + kMore);
    bool hit = meets(texel, int(more.y), 0.0, origin, direction, t, uv, share, work);
#endif
#if GLOSSY
    bool wanted = hit && t < found.tBehind[kBehind - 1];
#else
    bool wanted = hit && t < found.t;
#endif
    if (wanted) {
      // As wide as the cone, with the area that it has on the slanted image
      float slant = max(0.05, abs(dot(texelFetch(impostorTable, texel + kPlane).xyz, direction)));
      float level = max(0.0, log2(spread * (distance + t) / more.z * inversesqrt(slant)));
#if WALLS
      vec4 color = int(more.y) == kWayShared ? vec4(0.0, 0.0, 0.0, 1.0)
                                             : shownAt(vec3(uv, more.x), level, int(more.y));
#else
      vec4 color = shownAt(vec3(uv, more.x), level, int(more.y));
#endif
      if (color.a > 0.0) {
#if GLOSSY
        bool first = t < found.t;
        keepBehind(first, t, color, found);
        if (!first) continue;
#endif
        found.t = t;
        found.impostor = impostor;
        found.color = color;
        found.uv = uv;
        found.level = level;
        found.share = share;
        found.way = int(more.y);
      }
    }
  }
#if WALLS
  if (found.impostor >= 0 && found.share > 0.0) marks |= kMaskTransition;
  if (found.impostor >= 0 && found.way == kWayShared) {
    // The blended ray r_m [Popescu2006, Sec. 3.2]; on the quad itself the ray to the hit
    vec3 towards = normalize(origin + found.t * direction - cubeCentre);
    found.color.rgb = textureLod(environmentMap, mix(towards, direction, found.share), 0.0).rgb;
  } else if (found.impostor >= 0 && found.share > 0.0) {
    found.color = mix(found.color, vec4(environmentAlong(origin, direction, 0.0), 1.0), found.share);
  }
#endif
  return found;
}

// Radiance along a ray from a place of an object: of its impostors, and of the environment map behind.
vec3 seenAlong(int object, vec3 origin, vec3 direction, float distance, float spread,
               float mapLevel, inout uint work, inout uint marks) {
  Found found = nearest(object, false, origin, direction, distance, spread, work, marks);
  bool none = found.impostor < 0;
#if VIEWS
  if (found.hidden < found.t) marks |= kMaskDisoccluded;
#endif
#if GLOSSY
  // What lies beside each other shares a cone: walls that meet leave no gap
  vec4 seen = found.color;
  for (int k = 0; k < kBehind; ++k)
    if (found.tBehind[k] < 1e30)
      seen += min(1.0, (1.0 - seen.a) / found.behind[k].a) * found.behind[k];
#else
  vec4 seen = found.color;
#endif
#if BOUNCES > 1
  int texel = max(found.impostor, 0) * kTableTexels;
  vec4 more = texelFetch(impostorTable, texel + kMore);
  if (!none && more.w > 0.0) {
    marks |= kMarkSecond;
    vec3 normalAt = vec3(found.uv, 2.0 * more.x);
    vec3 specularAt = vec3(found.uv, 2.0 * more.x + 1.0);
    bool isPlane = found.way == kWayPlane || found.way == kWayBox;
    vec4 normal = isPlane ? textureLod(planeNormals, normalAt, found.level)
                          : textureLod(impostorNormals, normalAt, found.level);
    vec4 specular = isPlane ? textureLod(planeNormals, specularAt, found.level)
                            : textureLod(impostorNormals, specularAt, found.level);
    float s = specular.r / max(specular.a, 1e-6);
    vec3 n = normalize(normal.xyz + vec3(0.0, 1e-20, 0.0));
    if (dot(n, direction) > 0.0) n = -n;
    vec3 from = origin + found.t * direction;
    vec3 again = reflect(direction, n);
    Found second = nearest(int(texelFetch(impostorTable, texel + kWalls).g), !secondDiffuse, from,
                           again, distance + found.t, spread, work, marks);
    vec3 incoming = second.color.rgb;
#if FADES
    incoming *= exp(-second.t / fadeMetres);
#endif
    if (second.color.a < 1.0) {
      incoming += (1.0 - second.color.a) * environmentAlong(from, again, mapLevel);
      marks |= kMaskEnvironment;
    }
    vec3 tint = texelFetch(impostorTable, texel + kTint).rgb;
    seen.rgb = (1.0 - s) * seen.rgb + s * found.color.a * tint * incoming;
  }
#endif
#if FADES
  seen.rgb *= exp(-found.t / fadeMetres);
#endif
  if (seen.a < 0.999) {
    seen.rgb += (1.0 - seen.a) * environmentAlong(origin, direction, mapLevel);
    marks |= kMaskEnvironment;
  }
  return seen.rgb;
}

void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  vec4 normalAndG = texelFetch(normalSamples, at, 0);
  int object = int(texelFetch(objectSamples, at, 0).r);
  if (texelFetch(impostorLists, 3 * object).r < 0) discard;
  vec3 ray = rayFromSample * vec3(gl_FragCoord.xy, 1.0);
  float scale = nearMetres / max(texelFetch(depthSamples, at, 0).r, 1e-30);
  vec3 origin = eye + scale * ray;
  float distance = scale * length(ray);
  vec3 direction = normalize(reflect(normalize(ray), normalAndG.xyz));
  uint marks = isBent(normalAndG.a) ? kMaskBelowHorizon : 0u;
  uint work = 0u;
#if GLOSSY
  float code = lobeOf(normalAndG.a);
  vec3 normal = normalAndG.xyz;
  SampleLobe lobe = sampleLobe(code, normal, normalize(ray), direction, normal);
  float widest = lobeVariance(code, -dot(normal, normalize(ray)));
  vec3 seen = vec3(0.0);
  for (int k = 0; k < kLobeRays; ++k) {
    float weight;
    bool below;
    vec3 along = lobeDirection(lobe, k, kLobeRays, lobeShift(at), weight, below);
    if (below) marks |= kMaskBelowHorizon;
    float cosine = max(dot(along, direction), 0.0);
    float density = (lobe.exponent + 1.0) / kFullTurn * pow(cosine, lobe.exponent);
#if GGX
    vec3 view = -normalize(ray);
    if (isGgx(code)) density = ggxResponse(lobe.view, normal, view, along) / max(weight, 1e-6);
#endif
    // Sparse rays stand for more of the lobe, up to twice an even share
    float variance =
        min(2.0 * widest, 1.0 / max(kFullTurn * density, 1e-6)) / float(kLobeRays);
    float mapLevel = clamp(levelOffset + 0.5 * log2(variance), 0.0, lastLevel);
    float spread = max(spreadRad, 2.0 * sqrt(variance));
    seen += weight * seenAlong(object, origin, along, 0.0, spread, mapLevel, work, marks);
  }
  seen /= float(kLobeRays);
#else
  vec3 seen = seenAlong(object, origin, direction, distance, spreadRad, 0.0, work, marks);
#endif
  if (max(seen.r, max(seen.g, seen.b)) >= kClampedRadiance) marks |= kMaskClamped;
  reflection = vec4(seen, 1.0);
  known = marks | (min(work, 0xFFFFu) << kWorkShift);
#if MASKS
  mask = marks & ~kMarkSecond;
#endif
}
