// A walk over the texels of a depth map along a ray's projection.
layout(binding = kDepthsUnit) uniform sampler2DArray depthMaps;

// Depth of a line at a texel's centre along the major axis; 0: background. As Columns::at() of srdm.cpp.
float depthBetween(int layer, int size, bool alongX, int major, float minor) {
  float at = minor - 0.5;
  float low = floor(at);
  int j = int(low);
  float f = at - low;
  int k = clamp(j, 0, size - 1);
  int l = clamp(j + 1, 0, size - 1);
  float a = texelFetch(depthMaps, alongX ? ivec3(major, k, layer) : ivec3(k, major, layer), 0).r;
  float b = texelFetch(depthMaps, alongX ? ivec3(major, l, layer) : ivec3(l, major, layer), 0).r;
  a = j == k ? a : 0.0;
  b = j + 1 == l ? b : 0.0;
  if (a > 0.0 && b > 0.0) return a + f * (b - a);
  return f < 0.5 ? a : b;
}

// The first place where a ray from a to b (in texels, and depth) crosses the map, as a share of it; 2:
// none. On its whole way (reach negative), or so many texels about a share of it. `any`: whether the
// map shows anything there.
float walks(int layer, int size, vec3 a, vec3 b, float around, int reach, float steepest,
            out bool any, inout uint work) {
  vec2 d = b.xy - a.xy;
  bool alongX = abs(d.x) >= abs(d.y);
  vec2 from = alongX ? a.xy : a.yx;  // major, minor
  vec2 to = alongX ? b.xy : b.yx;
  float slope = abs(to.x - from.x) > 1e-4 ? (to.y - from.y) / (to.x - from.x) : 0.0;
  bool onwards = to.x >= from.x;
  // Texels whose centres bracket the projection
  int first = int(floor(min(from.x, to.x) - 0.5));
  int last = int(floor(max(from.x, to.x) - 0.5)) + 1;
  first = clamp(first, 0, size - 1);
  last = clamp(last, 0, size - 1);
  if (reach >= 0) {
    int middle = int(floor(mix(from.x, to.x, around) - 0.5));
    first = max(first, clamp(middle - reach, 0, size - 1));
    last = min(last, clamp(middle + reach + 1, 0, size - 1));
  }
  int at = onwards ? first : last;
  int end = onwards ? last : first;
  int way = onwards ? 1 : -1;
  float share = 2.0;
  any = false;
  vec2 ends0 = vec2(from.x, a.z);
  vec2 ends1 = vec2(to.x, b.z);
  vec2 before = vec2(0.0);
  bool wasOn = false;
  bool alone = false;  // a span of one texel
  for (int i = 0; i < 8192; ++i) {
    bool past = (at - end) * way > 0;
    float place = float(at) + 0.5;
    float g = past ? 0.0
                   : depthBetween(layer, size, alongX, at, from.y + slope * (place - from.x));
    bool on = g > 0.0;
    any = any || on;
    vec2 here = vec2(place, g);
    vec2 p = before;
    vec2 q = here;
    if (!on && alone) {
      p.x -= 0.499;
      q = before + vec2(0.499, 0.0);
    }
    if (wasOn && (on || alone)) {
      float met = crossing(ends0, ends1, p, q);
#if VIEWS
      if (steepest > 0.0 && met <= 1.0 && abs(q.y - p.y) > steepest) return kHidden + met;
#endif
      share = min(share, met);
    }
#if VIEWS
    if (steepest > 0.0 && on && share > 1.0) {
      float s = clamp((place - from.x) / (to.x - from.x), 0.0, 1.0);
      if (a.z + s * (b.z - a.z) < g) return kHidden + s;
    }
#endif
    if (past || share <= 1.0) break;
    ++work;
    alone = on && !wasOn;
    wasOn = on;
    before = here;
    at += way;
  }
  return share;
}
