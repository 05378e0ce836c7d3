// Lobes of reflective places: scene/lobe.h, the same formulas in the same order. A lobe is one number:
// a Phong lobe's g, or 2 + the roughness of a GGX lobe.
//   GGX  1: some lobes are GGX' (0 when it is not defined)
#ifndef GGX
#define GGX 0
#endif
const float kLobePi = 3.14159265358979;

// The alpha of the G-buffer's normals: the lobe, or -1 - lobe where the normal was bent.
float lobeOf(float alpha) { return alpha < 0.0 ? -1.0 - alpha : alpha; }
bool isBent(float alpha) { return alpha < 0.0; }

bool isGgx(float lobe) { return lobe >= 2.0; }
float roughnessOf(float lobe) { return isGgx(lobe) ? lobe - 2.0 : lobe; }
// A mirror up to here: scene::kMirrorPhongRoughness, scene::kMirrorGgxRoughness
bool isMirrorLobe(float lobe) { return isGgx(lobe) ? lobe <= 2.0 + 0.03 : lobe <= 0.05; }

// scene::phongExponentFromRoughness()
float phongExponent(float g) {
  float g2 = max(g, 1e-3) * max(g, 1e-3);
  return max(0.0, 2.0 / (g2 * g2) - 2.0);
}

float ggxHalfAngle(float alpha, float cosine) {
  float c = clamp(cosine, 0.2, 1.0);
  float share = 0.5911 + 0.3849 * c + (0.606 - 1.1465 * c) * alpha;
  return 2.0 * atan(1.3108 * alpha) * share;
}

// scene::coneExponent(); cosine: of the view to the normal.
float coneExponent(float lobe, float cosine) {
#if GGX
  float roughness = lobe - 2.0;
  float angle = max(ggxHalfAngle(roughness * roughness, cosine), 1e-6);
  return isGgx(lobe) ? max(0.0, 2.0 / (angle * angle) - 1.0) : phongExponent(lobe);
#else
  return phongExponent(lobe);
#endif
}

// Of a lobe about the mirrored ray per axis, steradians: 1 / (n + 1), and 2 pi times that the solid
// angle. At most 1.
float lobeVariance(float lobe, float cosine) {
  float g2 = lobe * lobe;
  float variance = 1.0 / max(1.0, 2.0 / max(g2 * g2, 1e-12) - 1.0);
#if GGX
  variance = isGgx(lobe) ? 1.0 / max(1.0, coneExponent(lobe, cosine) + 1.0) : variance;
#endif
  return variance;
}

float ggxLambda(float alpha, float cosine) {
  float c2 = max(cosine * cosine, 1e-12);
  return 0.5 * (sqrt(1.0 + alpha * alpha * max(1.0 - c2, 0.0) / c2) - 1.0);
}

float ggxNormals(float alpha, float cosine, float sine2) {
  float a2 = alpha * alpha;
  float t = a2 * cosine * cosine + sine2;
  return a2 / (kLobePi * t * t);
}

struct GgxView {
  float alpha;
  float sine;
  float cosine;
  float lambda;
  vec2 hemi;
};
GgxView ggxView(float alpha, float cosine) {
  GgxView view;
  view.alpha = max(alpha, 1e-6);
  view.cosine = clamp(cosine, 1e-4, 1.0);
  view.sine = sqrt(max(0.0, 1.0 - view.cosine * view.cosine));
  view.lambda = ggxLambda(view.alpha, view.cosine);
  float x = view.alpha * view.sine;
  view.hemi = vec2(x, view.cosine) * (1.0 / sqrt(x * x + view.cosine * view.cosine));
  return view;
}

// scene::ggxRay(): the direction in the view's frame; weight and density.
vec3 ggxRay(GgxView view, vec2 disk, out float weight, out float density) {
  float s = 0.5 * (1.0 + view.hemi.y);
  float chord = sqrt(max(0.0, 1.0 - disk.x * disk.x));
  float t = (1.0 - s) * chord + s * disk.y;
  float up = sqrt(max(0.0, 1.0 - disk.x * disk.x - t * t));
  vec3 h = vec3(view.alpha * (up * view.hemi.x - t * view.hemi.y), view.alpha * disk.x,
                max(up * view.hemi.y + t * view.hemi.x, 0.0));
  vec3 n = h * (1.0 / sqrt(max(dot(h, h), 1e-30)));
  float twice = 2.0 * (view.sine * n.x + view.cosine * n.z);
  vec3 ray = vec3(twice * n.x - view.sine, twice * n.y, twice * n.z - view.cosine);
  float above = 1.0 + view.lambda;
  weight = ray.z > 0.0 ? above / (above + ggxLambda(view.alpha, ray.z)) : 0.0;
  density = ggxNormals(view.alpha, n.z, n.x * n.x + n.y * n.y) / (above * 4.0 * view.cosine);
  return ray;
}

// scene::ggxResponse()
float ggxResponse(GgxView view, vec3 normal, vec3 toView, vec3 light) {
  float cosine = dot(normal, light);
  vec3 sum = toView + light;
  vec3 middle = dot(sum, sum) > 0.0 ? normalize(sum) : normal;
  vec3 across = cross(middle, normal);
  float normals = ggxNormals(view.alpha, dot(middle, normal), dot(across, across));
  float response =
      normals / ((1.0 + view.lambda + ggxLambda(view.alpha, cosine)) * 4.0 * view.cosine);
  return cosine > 0.0 ? response : 0.0;
}

// scene::meanSchlick()
float meanSchlick(float roughness, float cosine) {
  float r = clamp(roughness, 0.0, 1.0);
  float c = clamp(cosine, 0.0, 1.0);
  float k0 = 0.001 + c * (-2.479 + c * (5.34 - 1.17 * c));
  float k1 = 2.572 + c * (-1.081 - 4.764 * c);
  float k2 = -3.33 + 3.275 * c + 1.173 * r;
  float bent = r > 0.03 ? r * (k0 + r * (k1 + r * k2)) : 0.0;
  float m = 1.0 - clamp(c + bent, 0.0, 1.0);
  return (m * m) * (m * m) * m;
}

// The G-buffer's lobe horizons (raster::lobeHorizonOf): octahedral, in two halves of 16 bits. No
// half is packed as -32768, which leaves 0 to say that there is none.
uint packedLobeHorizon(vec3 normal) {
  vec3 n = normal / (abs(normal.x) + abs(normal.y) + abs(normal.z));
  float fold = max(-n.z, 0.0);
  vec2 side = vec2(n.x >= 0.0 ? 1.0 : -1.0, n.y >= 0.0 ? 1.0 : -1.0);
  // Below, |x| becomes 1 - |y|, |y| 1 - |x|: both grow by -z
  return packSnorm2x16(n.xy + side * fold) ^ 0x80008000u;
}
vec3 lobeHorizonOf(uint code, vec3 normal) {
  vec2 e = unpackSnorm2x16(code ^ 0x80008000u);
  float z = 1.0 - abs(e.x) - abs(e.y);
  float fold = max(-z, 0.0);
  vec2 side = vec2(e.x >= 0.0 ? 1.0 : -1.0, e.y >= 0.0 ? 1.0 : -1.0);
  return code == 0u ? normal : normalize(vec3(e - side * fold, z));
}
