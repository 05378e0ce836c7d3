// What `intersect` must at least read and write, and nothing else: for second_order_benchmark.
//   KIND  0 mirrored sample grids, 1 mirror rays: the texels that their walks have read
#include "methods/second_order/shaders/samples.glsl"
#include "methods/second_order/shaders/walk.glsl"

layout(binding = 7, rgba32f) readonly uniform image2D walks;  // of walks.frag; as large as normals

layout(location = 0) out vec4 reflection;

void main() {
  ivec2 sampleAt = ivec2(gl_FragCoord.xy);
  int cluster = int(max(imageLoad(clusterSamples, sampleAt).r, 2u)) - 2;
#if KIND == 0
  vec4 grid = tableOf(cluster, kMore);
  vec2 at = vec2(grid.y - gl_FragCoord.x, gl_FragCoord.y - grid.z) * grid.w;
  float depth = textureLod(depthImages, vec3(at * atlasTexel, grid.x), 0.0).r;
  reflection = vec4(imageLoad(colorImages, ivec3(at, int(grid.x))).rgb, depth);
#else
  vec4 sum = vec4(textureLod(depthSamples, gl_FragCoord.xy * sampleSize, 0.0).r);
  for (int k = 0; k < 7; ++k) sum += tableOf(cluster, k);
  vec4 recorded = imageLoad(walks, sampleAt);
  vec2 layerAndTexels = floor(recorded.xy * (1.0 / 16384.0));
  vec2 at = (recorded.xy - 16384.0 * layerAndTexels + 0.5) * atlasTexel;
  vec2 stride = recorded.zw * atlasTexel;
  int texels = int(layerAndTexels.y);
  for (int i = 0; i < texels; ++i) {
    sum.a += textureLod(depthImages, vec3(at, layerAndTexels.x), 0.0).r;
    at += stride;
  }
  sum += textureGather(depthImages, vec3(at, layerAndTexels.x));
  ivec3 corner = ivec3(ivec2(at / atlasTexel), int(layerAndTexels.x));
  for (int k = 0; k < 4; ++k) sum += imageLoad(colorImages, corner + ivec3(k & 1, k >> 1, 0));
  reflection = sum;
#endif
}
