// The alpha of the G-buffer's normals: g, or -1 - g where the normal was bent (raster::glossinessOf).
float glossOf(float alpha) { return alpha < 0.0 ? -1.0 - alpha : alpha; }
bool isBent(float alpha) { return alpha < 0.0; }

// g up to here is a mirror (scene/reflectance.h)
const float kLargestMirrorG = 0.05;

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
