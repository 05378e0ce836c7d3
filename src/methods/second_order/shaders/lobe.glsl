// The rays of a lobe, as trace::lobeDirection() has them, of RAYS for each sample.
#include "raster/shaders/shading.glsl"
#include "walk.glsl"

float radicalInverse2(uint i) {
  return float(bitfieldReverse(i) >> 8) * (1.0 / 16777216.0);
}

// Where in its cells a sample's lobe is sampled.
vec2 lobeShift(ivec2 sampleAt, int samplesPerPixel) {
  int cell = (sampleAt.y % samplesPerPixel) * samplesPerPixel + sampleAt.x % samplesPerPixel;
  return vec2((float(cell) + 0.5) / float(samplesPerPixel * samplesPerPixel),
              fract(float(cell) * 0.6180340));
}

// Ray `index` of the lobe about `mirror`; folded up where it is `below` the shading normal's plane.
vec3 lobeDirection(vec3 mirror, vec3 normal, float exponent, int index, vec2 shift, out bool below) {
  float u = (float(index) + shift.x) / float(RAYS);
  float v = fract(radicalInverse2(uint(index)) + shift.y);
  float cosine = pow(max(1.0 - u, 1e-7), 1.0 / (exponent + 1.0));
  float sine = sqrt(max(0.0, 1.0 - cosine * cosine));
  float angle = 2.0 * kPi * v;
  float turn = mirror.z < 0.0 ? -1.0 : 1.0;
  float a = -1.0 / (turn + mirror.z);
  float b = mirror.x * mirror.y * a;
  vec3 x = vec3(1.0 + turn * mirror.x * mirror.x * a, turn * b, -turn * mirror.x);
  vec3 y = vec3(b, turn + mirror.y * mirror.y * a, -mirror.y);
  vec3 direction = normalize(sine * cos(angle) * x + sine * sin(angle) * y + cosine * mirror);
  float above = dot(direction, normal);
  below = above < 0.0;
  return below ? direction - 2.0 * above * normal : direction;
}

// What the image shows where a ray of a lobe would be, were it as long as the one in its centre
// [Wang2014, section 4.2.2].
Hit lookUp(DepthImage image, Start start, vec3 direction, Hit centre, float limit) {
  float t = min(centre.metres, limit);
  vec3 end = start.place + t * vec3(dot(image.rowX.xyz, direction), dot(image.rowY.xyz, direction),
                                    dot(image.rowW.xyz, direction));
  vec2 at = end.xy / max(end.z, 1e-30);
  bool inside = end.z > 0.0 && all(greaterThanEqual(at, vec2(0.0))) &&
                all(lessThan(at, image.place.zw));
  vec2 texel = clamp(at, vec2(0.0), image.place.zw - 1.0);
  float height = heightAt(image, texel);
  int layer = 0;
#if LAYERS == 2
  // Of both layers what lies about where the ray ends
  float second = secondAt(image, texel);
  float ends = image.horizon.w / end.z;
  bool nearer = second > 0.0 && abs(second - ends) < abs(height - ends);
  height = nearer ? second : height;
  layer = nearer ? secondLayer : 0;
#endif
  int kind = centre.kind == kMissed || !inside ? kMissed : height > 0.0 ? kHit : kSky;
  return Hit(kind, at, height, kind == kHit && centre.bridged, t, kind == kHit ? layer : 0);
}
