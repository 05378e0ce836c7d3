// Clusters' depth images on the layers of their atlas, and the table that says where they are.
//   LAYERS  2: with a second depth layer, of what lies behind
#include "constants.glsl"

layout(binding = kTableBinding, rgba32f) readonly uniform imageBuffer clusterTable;
layout(binding = kColorImagesBinding, rgba16f) readonly uniform image2DArray colorImages;
layout(binding = kDepthImagesBinding) uniform sampler2DArray depthImages;

uniform vec2 atlasTexel;  // 1 / texels of a layer
#if LAYERS == 2
uniform int secondLayer;  // from an image's layer of the atlas to the one with what lies behind
#endif

struct DepthImage {
  vec4 rowX;
  vec4 rowY;
  vec4 rowW;
  vec4 place;
  vec4 more;
  vec4 horizon;  // depth infinitely far: dot(xyz, (texel, 1)); height above it times W
  bool crossing;
  bool concave;
};

vec4 tableOf(int cluster, int row) { return imageLoad(clusterTable, cluster * kTableTexels + row); }

DepthImage depthImage(int cluster) {
  DepthImage d;
  d.more = tableOf(cluster, kMore);
  d.place = tableOf(cluster, kPlace);
  d.rowX = tableOf(cluster, kRowX);
  d.rowY = tableOf(cluster, kRowX + 1);
  d.rowW = tableOf(cluster, kRowX + 2);
  d.horizon = tableOf(cluster, kHorizon);
  int flags = int(tableOf(cluster, kFlags).x);
  d.crossing = (flags & kCrossingFlag) != 0;
  d.concave = (flags & kConcaveFlag) != 0;
  return d;
}

// What an image's depth is above its horizon at the texel's own centre, where it was drawn: 1 / W of
// what it shows, times a constant, however oblique the image is. 0 where nothing was drawn.
float aboveHorizon(DepthImage image, float depth, vec2 centre) {
  float height = depth - dot(image.horizon.xyz, vec3(centre, 1.0));
  return depth > 0.0 ? max(height, 1e-30) : 0.0;
}
// By its centre, the filter being nearest: of texelFetch llvmpipe makes three times as many
// instructions.
float heightAt(DepthImage image, float layer, vec2 texel) {
  vec2 centre = floor(texel) + 0.5;
  vec2 at = (centre + image.place.xy) * atlasTexel;
  return aboveHorizon(image, textureLod(depthImages, vec3(at, layer), 0.0).r, centre);
}
float heightAt(DepthImage image, vec2 texel) { return heightAt(image, image.more.x, texel); }
#if LAYERS == 2
float secondAt(DepthImage image, vec2 texel) {
  return heightAt(image, image.more.x + float(secondLayer), texel);
}
#endif

// Of a hit's height, texels of the same surface differ by at most this share. Ours.
const float kAsDeep = 0.05;

// Bilinear colour over the texels that lie about as deep as the hit: edges do not bleed.
vec3 colorAt(DepthImage image, vec2 at, float height) {
  vec2 corner = clamp(at - 0.5, vec2(0.0), image.place.zw - 1.0);
  vec2 base = min(floor(corner), max(image.place.zw - 2.0, 0.0));
  vec2 f = corner - base;
  vec2 first = base + image.place.xy;
  ivec3 origin = ivec3(ivec2(first), int(image.more.x));
  // In the order (0, 1), (1, 1), (1, 0), (0, 0)
  vec4 there = textureGather(depthImages, vec3((first + 1.0) * atlasTexel, image.more.x));
  vec4 weights = vec4(1.0 - f.x, f.x, f.x, 1.0 - f.x) * vec4(f.y, f.y, 1.0 - f.y, 1.0 - f.y);
  float horizon = dot(image.horizon.xyz, vec3(base + 0.5, 1.0));
  vec4 horizons = horizon + vec4(0.0, image.horizon.x, image.horizon.x, 0.0) +
                  vec4(image.horizon.y, image.horizon.y, 0.0, 0.0);
  bvec4 asDeep = lessThanEqual(abs(there - horizons - height), vec4(kAsDeep * height));
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

// The nearest texel's colour. Where nothing was drawn the image still has an earlier frame's.
vec3 nearestColorAt(DepthImage image, vec2 at) {
  vec2 texel = clamp(at, vec2(0.0), image.place.zw - 1.0);
  ivec2 at2 = ivec2(texel) + ivec2(image.place.xy);
  vec3 color = imageLoad(colorImages, ivec3(at2, int(image.more.x))).rgb;
  return heightAt(image, texel) > 0.0 ? color : vec3(0.0);
}
