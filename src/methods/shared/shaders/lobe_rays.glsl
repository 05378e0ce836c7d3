// The rays of a Phong lobe, as trace::lobeDirection() has them.

const float kFullTurn = 6.28318530717958;

float radicalInverse2(uint i) {
  return float(bitfieldReverse(i) >> 8) * (1.0 / 16777216.0);
}

// Where in its cells a sample's lobe is sampled.
vec2 lobeShift(ivec2 sampleAt, int samplesPerPixel) {
  int cell = (sampleAt.y % samplesPerPixel) * samplesPerPixel + sampleAt.x % samplesPerPixel;
  return vec2((float(cell) + 0.5) / float(samplesPerPixel * samplesPerPixel),
              fract(float(cell) * 0.6180340));
}

// scene::phongExponentFromGlossiness()
float lobeExponent(float g) {
  float g2 = max(g, 1e-3) * max(g, 1e-3);
  return max(0.0, 2.0 / (g2 * g2) - 2.0);
}

// Ray `index` of `count` of the lobe about `mirror`, and the density, per steradian, with which
// such rays are sent.
vec3 lobeDirection(vec3 mirror, float exponent, int index, int count, vec2 shift,
                   out float density) {
  float u = (float(index) + shift.x) / float(count);
  float v = fract(radicalInverse2(uint(index)) + shift.y);
  float cosine = pow(max(1.0 - u, 1e-7), 1.0 / (exponent + 1.0));
  float sine = sqrt(max(0.0, 1.0 - cosine * cosine));
  float angle = kFullTurn * v;
  float turn = mirror.z < 0.0 ? -1.0 : 1.0;
  float a = -1.0 / (turn + mirror.z);
  float b = mirror.x * mirror.y * a;
  vec3 x = vec3(1.0 + turn * mirror.x * mirror.x * a, turn * b, -turn * mirror.x);
  vec3 y = vec3(b, turn + mirror.y * mirror.y * a, -mirror.y);
  // (n + 1) / (2 pi) cos^n, by the u that gave the cosine
  density = (exponent + 1.0) * (1.0 / kFullTurn) * max(1.0 - u, 1e-7) / cosine;
  return normalize(sine * cos(angle) * x + sine * sin(angle) * y + cosine * mirror);
}

// A direction `below` the plane of lobeHorizon (gloss.glsl) is folded up.
vec3 foldedUp(vec3 direction, vec3 horizon, out bool below) {
  float above = dot(direction, horizon);
  below = above < 0.0;
  return below ? direction - 2.0 * above * horizon : direction;
}
