// The rays of a lobe, as trace::lobeDirection() has them.
#include "raster/shaders/lobe.glsl"

const float kFullTurn = 6.28318530717958;

float radicalInverse2(uint i) {
  return float(bitfieldReverse(i) >> 8) * (1.0 / 16777216.0);
}

// Where in its cells a sample's lobe is sampled: methods::lobeShift().
vec2 lobeShift(ivec2 sampleAt) {
  uvec2 at = uvec2(sampleAt);
  uvec2 spread = (at & 1u) | (at & 2u) << 1 | (at & 4u) << 2;
  uint place = spread.x | spread.y << 1;
  uvec2 bits = 0x80000000u + place * uvec2(0xC13FA9A9u, 0x91E10DA5u);  // kR2xBits, kR2yBits
  return vec2(bits >> 8) * (1.0 / 16777216.0);
}

// A sample's lobe.
struct SampleLobe {
  float code;      // lobe.glsl
  float exponent;  // of Phong's, or of the Phong lobe that is as wide
  vec3 mirror;
  vec3 horizon;    // rays stay above its plane
#if GGX
  vec3 x, y, z;    // the frame of the view
  GgxView view;
#endif
};
SampleLobe sampleLobe(float code, vec3 normal, vec3 incoming, vec3 mirror, vec3 horizon) {
  SampleLobe lobe;
  float cosine = -dot(normal, incoming);
  lobe.code = code;
  lobe.exponent = coneExponent(code, cosine);
  lobe.mirror = mirror;
  lobe.horizon = horizon;
#if GGX
  lobe.view = ggxView(roughnessOf(code) * roughnessOf(code), cosine);
  vec3 along = -incoming - cosine * normal;
  float length2 = dot(along, along);
  float turn = normal.z < 0.0 ? -1.0 : 1.0;
  float a = -1.0 / (turn + normal.z);
  vec3 any = vec3(1.0 + turn * normal.x * normal.x * a, turn * normal.x * normal.y * a,
                  -turn * normal.x);
  lobe.x = length2 > 1e-12 ? along / sqrt(length2) : any;
  lobe.y = cross(normal, lobe.x);
  lobe.z = normal;
#endif
  return lobe;
}

vec3 phongDirection(vec3 mirror, float exponent, float u, float v) {
  float cosine = pow(max(1.0 - u, 1e-7), 1.0 / (exponent + 1.0));
  float sine = sqrt(max(0.0, 1.0 - cosine * cosine));
  float angle = kFullTurn * v;
  float turn = mirror.z < 0.0 ? -1.0 : 1.0;
  float a = -1.0 / (turn + mirror.z);
  float b = mirror.x * mirror.y * a;
  vec3 x = vec3(1.0 + turn * mirror.x * mirror.x * a, turn * b, -turn * mirror.x);
  vec3 y = vec3(b, turn + mirror.y * mirror.y * a, -mirror.y);
  return normalize(sine * cos(angle) * x + sine * sin(angle) * y + cosine * mirror);
}

// Ray `index` of `count` of a lobe, with its weight in the lobe's mean; folded up where it was
// `below` the plane of the horizon.
vec3 lobeDirection(SampleLobe lobe, int index, int count, vec2 shift, out float weight,
                   out bool below) {
  float u = (float(index) + shift.x) / float(count);
  float v = fract(radicalInverse2(uint(index)) + shift.y);
  weight = 1.0;
#if GGX
  float density;
  vec2 disk = sqrt(u) * vec2(cos(kFullTurn * v), sin(kFullTurn * v));
  vec3 ray = ggxRay(lobe.view, disk, weight, density);
  vec3 direction = normalize(ray.x * lobe.x + ray.y * lobe.y + ray.z * lobe.z);
  weight = isGgx(lobe.code) ? weight : 1.0;
  direction = isGgx(lobe.code) ? direction : phongDirection(lobe.mirror, lobe.exponent, u, v);
#else
  vec3 direction = phongDirection(lobe.mirror, lobe.exponent, u, v);
#endif
  float above = dot(direction, lobe.horizon);
  below = above < 0.0 || !(weight > 0.0);
#if GGX
  weight = above < 0.0 && isGgx(lobe.code) ? 0.0 : weight;
#endif
  return above < 0.0 ? direction - 2.0 * above * lobe.horizon : direction;
}
