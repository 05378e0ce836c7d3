// What a ray sees where it has met a quad: the mean radiance over what it stands for
// [Yu2008, section 3.4].
//   FILTER  0: the radiance of the nearest texel

// Least cosine of the angle at which a ray meets a surface, that its footprint is computed with.
const float kLeastCosine = 0.02;

// All levels lie beside each other (radiance.h): the level of a texture look-up would be that of four
// neighbouring pixels.
vec3 radianceOnLevel(vec2 place, uvec4 chart, uint level, float layer) {
  vec2 size = vec2(float((1u << chart.z) >> level));
  uint side = uint(textureSize(radiance, 0).y);
  uvec2 origin = level == 0u ? uvec2(0u) : uvec2(side, side - (side >> (level - 1u)));
  vec2 texel = clamp(place * size, vec2(0.5), size - 0.5) + vec2((chart.xy >> level) + origin);
  return textureLod(radiance, vec3(texel / vec2(textureSize(radiance, 0).xy), layer), 0.0).rgb;
}

// The place of a hit in its chart, 0..1.
vec2 placeInChart(uvec4 quad, uvec4 chart, vec2 at) {
  vec2 corner = vec2(quad.w & 0xFFFu, quad.w >> 12 & 0xFFFu);
  return (corner + at * float(1u << (quad.w >> 24))) / float(1u << chart.w);
}

vec4 nearestTexel(vec2 place, uvec4 chart, bool back) {
  ivec2 last = ivec2((1 << chart.z) - 1);
  ivec2 nearest = clamp(ivec2(place * float(1u << chart.z)), ivec2(0), last);
  return texelFetch(radiance, ivec3(ivec2(chart.xy) + nearest, back ? 1 : 0), 0);
}

// Mip level at which a texel is as large as the footprint of a ray of this width.
float levelOf(Found found, vec3 direction, float width) {
  uvec4 quad = texelFetch(quads, int(found.node));
  uvec4 chart = texelFetch(charts, int(quad.z));
  uint stride = 1u << (quad.w >> 24);
  bool upper = found.at.x + found.at.y > 1.0;
  int first = int(quad.x);
  vec3 p = texelFetch(vertices, upper ? first + int(quad.y + stride) : first).xyz;
  vec3 e1 = texelFetch(vertices, first + int(stride)).xyz - p;
  vec3 e2 = texelFetch(vertices, first + int(quad.y)).xyz - p;
  vec3 normal = cross(e1, e2);
  float cosine = abs(dot(normal, direction)) * inversesqrt(max(dot(normal, normal), 1e-38));
  float area = width * width / max(cosine, kLeastCosine);  // Eq. (8)
  vec4 texel = nearestTexel(placeInChart(quad, chart, found.at), chart, found.back);
  float texels = area / max(texel.a, 1e-38);
  return clamp(0.5 * log2(max(texels, 1e-38)), 0.0, float(chart.z));  // Eq. (9)
}

vec3 seen(Found found, vec3 direction, float width) {
  uvec4 quad = texelFetch(quads, int(found.node));
  uvec4 chart = texelFetch(charts, int(quad.z));
  vec2 place = placeInChart(quad, chart, found.at);
#if FILTER
  float level = levelOf(found, direction, width);
  float layer = found.back ? 1.0 : 0.0;
  uint fine = uint(level);
  uint coarse = min(fine + 1u, chart.z);
  return mix(radianceOnLevel(place, chart, fine, layer), radianceOnLevel(place, chart, coarse, layer),
             level - float(fine));
#else
  return nearestTexel(place, chart, found.back).rgb;
#endif
}
