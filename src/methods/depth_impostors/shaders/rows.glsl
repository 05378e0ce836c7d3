// A search over the segments of simplified lines of a depth map.
layout(binding = kRowsUnit) uniform samplerBuffer simplifiedRows;  // position, depth
layout(binding = kDomainsUnit) uniform samplerBuffer rowDomains;   // 1 along x, slope, first, offset
uniform int rowsOfMap;  // lines of all domains

// Where a ray from a to b crosses the line of a domain nearest to the middle of its projection.
float crossesLine(int layer, int domain, vec3 a, vec3 b, inout uint work) {
  vec4 line = texelFetch(rowDomains, domain);
  bool alongX = line.x > 0.5;
  vec2 middle = 0.5 * (a.xy + b.xy);
  float minor = alongX ? middle.y - line.y * middle.x : middle.x - line.y * middle.y;
  int row = int(line.w) + int(floor(minor) - line.z);
  int first = (layer * rowsOfMap + row) * POINTS;
  vec2 from = vec2(alongX ? a.x : a.y, a.z);
  vec2 to = vec2(alongX ? b.x : b.y, b.z);
  float share = 2.0;
  vec2 before = texelFetch(simplifiedRows, first).xy;
  before.x = abs(before.x);
  for (int i = 1; i < POINTS; ++i) {
    vec2 here = texelFetch(simplifiedRows, first + i).xy;
    if (here.x > 0.0) share = min(share, crossing(from, to, before, here));
    before = vec2(abs(here.x), here.y);
  }
  work += uint(POINTS - 1);
  return share;
}

// The first place where a ray from a to b (in texels, and depth) crosses the map, as a share of it; above 1:
// nowhere.
float searches(int layer, vec3 a, vec3 b, inout uint work) {
  vec2 d = b.xy - a.xy;
  float turns = atan(d.y, d.x) / 3.14159265358979;  // -1 .. 1, of half turns
  float at = (turns - floor(turns)) * float(DOMAINS);
#if WAY == 1
  int domain = int(floor(at + 0.5));
  return crossesLine(layer, domain >= DOMAINS ? domain - DOMAINS : domain, a, b, work);
#else
  // DEVIATION: the paper leaves it to the future and does not say how
  int low = int(floor(at));
  float f = at - float(low);
  low = low >= DOMAINS ? low - DOMAINS : low;
  float one = crossesLine(layer, low, a, b, work);
  float two = crossesLine(layer, low + 1 >= DOMAINS ? 0 : low + 1, a, b, work);
  bool both = one <= 1.0 && two <= 1.0;
  return both ? mix(one, two, f) : f < 0.5 ? one : two;
#endif
}
