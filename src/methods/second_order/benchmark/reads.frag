// What `intersect` must at least read and write, and nothing else: for second_order_benchmark.
//   KIND  0 mirrored sample grids, 1 mirror rays: the texels that their walks have read
layout(binding = 0, r16ui) readonly uniform uimage2D clusterSamples;
layout(binding = 1, rgba32f) readonly uniform image2D walks;  // of intersect.frag, by RECORD; as large as normals
layout(binding = 2) uniform sampler2D depthSamples;
layout(binding = 3, rgba32f) readonly uniform imageBuffer clusterTable;
layout(binding = 5, rgba16f) readonly uniform image2DArray colorImages;
layout(binding = 6) uniform sampler2DArray depthImages;

uniform vec2 sampleSize;
uniform vec2 atlasTexel;

layout(location = 0) out vec4 reflection;

void main() {
  ivec2 sampleAt = ivec2(gl_FragCoord.xy);
  int row = 7 * (int(max(imageLoad(clusterSamples, sampleAt).r, 2u)) - 2);
#if KIND == 0
  vec4 grid = imageLoad(clusterTable, row + 5);
  vec2 at = vec2(grid.y - gl_FragCoord.x, gl_FragCoord.y - grid.z) * grid.w;
  float depth = textureLod(depthImages, vec3(at * atlasTexel, grid.x), 0.0).r;
  reflection = vec4(imageLoad(colorImages, ivec3(at, int(grid.x))).rgb, depth);
#else
  vec4 sum = vec4(textureLod(depthSamples, gl_FragCoord.xy * sampleSize, 0.0).r);
  for (int k = 0; k < 7; ++k) sum += imageLoad(clusterTable, row + k);
  vec4 walk = imageLoad(walks, sampleAt);
  vec2 layerAndTexels = floor(walk.xy * (1.0 / 16384.0));
  vec2 at = (walk.xy - 16384.0 * layerAndTexels + 0.5) * atlasTexel;
  vec2 stride = walk.zw * atlasTexel;
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
