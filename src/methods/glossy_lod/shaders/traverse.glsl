// The way of a ray through the tree, without a stack [Carr2006], as deep as its width asks for
// [Yu2008, section 3.3].
//   LEVELS  0: always down to the finest triangles
//   MASKED  1: some texels are cut away by alpha masks
#include "constants.glsl"

layout(binding = kNodesUnit) uniform usamplerBuffer nodes;       // two texels each (tree.h)
layout(binding = kQuadsUnit) uniform usamplerBuffer quads;       // by node
layout(binding = kVerticesUnit) uniform samplerBuffer vertices;  // xyz, world space
layout(binding = kChartsUnit) uniform usamplerBuffer charts;     // atlas x, y, texel level, level
layout(binding = kRadianceUnit) uniform sampler2DArray radiance;  // layers front, back; a = area
uniform uint nodeCount;

const uint kNothing = 0xFFFFFFFFu;
const uint kHasQuad = 1u;
const uint kIsLeaf = 2u;

// Width of a ray, metres, at a distance: base + slope * distance.
struct Width {
  float base;
  float slope;
};

struct Found {
  float metres;
  uint node;  // kNothing: the ray leaves the scene
  vec2 at;    // in the node's quad, 0..1
  bool back;  // the ray meets the quad's back
};

struct Visits {
  uint nodes;
  uint quads;
  uint stopped;  // quads of coarser levels
};

// A ray as the watertight test takes it [Woop2013]: its longest axis becomes z, and it runs along it.
struct Ray {
  vec3 origin;
  vec3 direction;
  vec3 inverse;
  int axis;
  vec3 shear;
};

vec3 turned(vec3 p, int axis) { return axis == 0 ? p.yzx : axis == 1 ? p.zxy : p; }

Ray makeRay(vec3 origin, vec3 direction) {
  Ray ray;
  ray.origin = origin;
  ray.direction = direction;
  vec3 d = mix(direction, vec3(1e-20), lessThan(abs(direction), vec3(1e-20)));
  ray.inverse = 1.0 / d;
  vec3 a = abs(direction);
  ray.axis = a.x >= a.y && a.x >= a.z ? 0 : a.y >= a.z ? 1 : 2;
  vec3 t = turned(direction, ray.axis);
  ray.shear = vec3(t.xy / t.z, 1.0 / t.z);
  return ray;
}

vec3 sheared(Ray ray, vec3 position) {
  precise vec3 p = turned(position - ray.origin, ray.axis);
  precise vec3 s = vec3(p.xy - ray.shear.xy * p.z, ray.shear.z * p.z);
  return s;
}

// Distance to a triangle nearer than `limit` and the weights of b and c; negative: none.
float meets(vec3 a, vec3 b, vec3 c, float limit, out vec2 weights, out float facing) {
  // The same edge gives the same number, but for its sign, in both triangles that have it
  precise float u = c.x * b.y - c.y * b.x;
  precise float v = a.x * c.y - a.y * c.x;
  precise float w = b.x * a.y - b.y * a.x;
  bool inside = (u >= 0.0 && v >= 0.0 && w >= 0.0) || (u <= 0.0 && v <= 0.0 && w <= 0.0);
  facing = u + v + w;
  float t = (u * a.z + v * b.z + w * c.z) / facing;
  weights = vec2(v, w) / facing;
  return inside && facing != 0.0 && t > 0.0 && t < limit ? t : -1.0;
}

#if MASKED
// Whether the alpha mask cuts the surface away there.
bool isCut(uvec4 quad, vec2 at) {
  uvec4 chart = texelFetch(charts, int(quad.z));
  vec2 corner = vec2(quad.w & 0xFFFu, quad.w >> 12 & 0xFFFu);
  vec2 place = (corner + at * float(1u << (quad.w >> 24))) / float(1u << chart.w);
  ivec2 texel = ivec2(min(place * float(1u << chart.z), vec2(float((1u << chart.z) - 1u))));
  return texelFetch(radiance, ivec3(ivec2(chart.xy) + texel, 0), 0).a < 0.0;
}
#endif

// Tests the two triangles of a node's quad.
void meetQuad(Ray ray, uint node, inout Found found) {
  uvec4 quad = texelFetch(quads, int(node));
  int first = int(quad.x);
  int up = int(quad.y);
  int right = 1 << (quad.w >> 24);
  vec3 v00 = sheared(ray, texelFetch(vertices, first).xyz);
  vec3 v10 = sheared(ray, texelFetch(vertices, first + right).xyz);
  vec3 v01 = sheared(ray, texelFetch(vertices, first + up).xyz);
  vec3 v11 = sheared(ray, texelFetch(vertices, first + up + right).xyz);
  vec2 weights;
  float facing;
  float lower = meets(v00, v10, v01, found.metres, weights, facing);
  bool hit = lower > 0.0;
#if MASKED
  hit = hit && !isCut(quad, weights);
#endif
  bool forwards = dot(ray.direction, ray.direction) > 0.0 && ray.shear.z > 0.0;
  found.metres = hit ? lower : found.metres;
  found.node = hit ? node : found.node;
  found.at = hit ? weights : found.at;
  found.back = hit ? (facing < 0.0) == forwards : found.back;
  float upper = meets(v11, v01, v10, found.metres, weights, facing);
  hit = upper > 0.0;
#if MASKED
  hit = hit && !isCut(quad, 1.0 - weights);
#endif
  found.metres = hit ? upper : found.metres;
  found.node = hit ? node : found.node;
  found.at = hit ? 1.0 - weights : found.at;
  found.back = hit ? (facing < 0.0) == forwards : found.back;
}

Found traverse(vec3 origin, vec3 direction, Width width, float alpha, inout Visits visits) {
  Ray ray = makeRay(origin, direction);
  Found found = Found(3e38, kNothing, vec2(0.0), false);
  uint node = 0u;
  while (node < nodeCount) {
    // On to the next quad to test. Boxes first, all quads then: a branch costs even who skips it.
    uint quad = kNothing;
    while (node < nodeCount && quad == kNothing) {
      uvec4 low = texelFetch(nodes, int(2u * node));
      uvec4 high = texelFetch(nodes, int(2u * node) + 1);
      vec3 least = uintBitsToFloat(low.xyz);
      vec3 most = uintBitsToFloat(high.xyz);
      vec3 a = (least - origin) * ray.inverse;
      vec3 b = (most - origin) * ray.inverse;
      vec3 near = min(a, b);
      vec3 far = max(a, b);
      float enters = max(max(near.x, near.y), near.z);
      // Two more ulps than rounding may take [Ize2013]
      float leaves = min(min(far.x, far.y), far.z) * 1.0000005;
      bool hit = leaves >= max(enters, 0.0) && enters <= found.metres;
      bool stop = (high.w & kIsLeaf) != 0u;
#if LEVELS
      // [Yu2008] Eqs. (6), (7), without their divisions; never from inside of the box
      vec3 size = most - least;
      vec3 way = 0.5 * (least + most) - origin;
      float wide = alpha * (width.base + width.slope * length(way));
      stop = stop || ((high.w & kHasQuad) != 0u && enters > 0.0 &&
                      0.25 * kPi * dot(size, size) <= wide * wide);
#endif
      quad = hit && stop ? node : kNothing;
      visits.stopped += hit && stop && (high.w & kIsLeaf) == 0u ? 1u : 0u;
      node = hit && !stop ? node + 1u : low.w;
      ++visits.nodes;
    }
    if (quad != kNothing) {
      meetQuad(ray, quad, found);
      ++visits.quads;
    }
  }
  return found;
}
