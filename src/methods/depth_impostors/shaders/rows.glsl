// A search over the segments of simplified lines of a depth map.
layout(binding = kRowsUnit) uniform samplerBuffer simplifiedRows;  // position, depth
layout(binding = kDomainsUnit) uniform samplerBuffer rowDomains;   // 1 along x, slope, first, offset
uniform int rowsOfMap;  // lines of all domains

#if VIEWS
// As in crossesLine<true>() of search.cpp.
void behindLine(vec2 from, vec2 to, vec2 p, vec2 q, float steepest, inout float met,
                inout float hidden) {
  vec2 d = to - from;
  vec2 e = q - p;
  bool front = d.x * e.y - d.y * e.x > 0.0 && abs(e.y) <= steepest * e.x;
  if (met <= 1.0 && !front) {
    hidden = min(hidden, met);
    met = 2.0;
  }
  float low = max(p.x, min(from.x, to.x));
  float high = min(q.x, max(from.x, to.x));
  float middle = 0.5 * (low + high);
  float s = (middle - from.x) / d.x;
  bool under = low <= high && (from.y + s * d.y - p.y) * e.x < (middle - p.x) * e.y;
  if (under) hidden = min(hidden, s);
}
#endif

// Where a ray from a to b crosses the line of a domain nearest to the middle of its projection.
float crossesLine(int layer, int domain, vec3 a, vec3 b, float steepest, inout uint work) {
  vec4 line = texelFetch(rowDomains, domain);
  bool alongX = line.x > 0.5;
  vec2 middle = 0.5 * (a.xy + b.xy);
  float minor = alongX ? middle.y - line.y * middle.x : middle.x - line.y * middle.y;
  int row = int(line.w) + int(floor(minor) - line.z);
  int first = (layer * rowsOfMap + row) * POINTS;
  vec2 from = vec2(alongX ? a.x : a.y, a.z);
  vec2 to = vec2(alongX ? b.x : b.y, b.z);
  float share = 2.0;
#if VIEWS
  float hidden = 2.0;
#endif
  vec2 before = texelFetch(simplifiedRows, first).xy;
  before.x = abs(before.x);
  for (int i = 1; i < POINTS; ++i) {
    vec2 here = texelFetch(simplifiedRows, first + i).xy;
#if VIEWS
    if (here.x > 0.0) {
      float met = crossing(from, to, before, here);
      if (steepest > 0.0) behindLine(from, to, before, here, steepest, met, hidden);
      share = min(share, met);
    }
#else
    if (here.x > 0.0) share = min(share, crossing(from, to, before, here));
#endif
    before = vec2(abs(here.x), here.y);
  }
  work += uint(POINTS - 1);
#if VIEWS
  if (hidden < share) return kHidden + hidden;
#endif
  return share;
}

// The first place where a ray from a to b (in texels, and depth) crosses the map, as a share of it; above 1:
// nowhere.
float searches(int layer, vec3 a, vec3 b, float steepest, inout uint work) {
  vec2 d = b.xy - a.xy;
  float turns = atan(d.y, d.x) / 3.14159265358979;  // -1 .. 1, of half turns
  float at = (turns - floor(turns)) * float(DOMAINS);
#if WAY == 1
  int domain = int(floor(at + 0.5));
  domain = domain >= DOMAINS ? domain - DOMAINS : domain;
  return crossesLine(layer, domain, a, b, steepest, work);
#else
  // DEVIATION: the paper leaves it to the future and does not say how
  int low = int(floor(at));
  float f = at - float(low);
  low = low >= DOMAINS ? low - DOMAINS : low;
  float one = crossesLine(layer, low, a, b, steepest, work);
  float two = crossesLine(layer, low + 1 >= DOMAINS ? 0 : low + 1, a, b, steepest, work);
  bool both = one <= 1.0 && two <= 1.0;
  return both ? mix(one, two, f) : f < 0.5 ? one : two;
#endif
}
