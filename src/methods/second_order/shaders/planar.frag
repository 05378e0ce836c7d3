// Radiance along the mirror rays of planar mirrors: the mirrored camera has a texel for each sample.
//   EXACT_GRID  1: at the depth images' own scale, so that a texel's colour is a sample's
#include "depth_image.glsl"
#include "marks.glsl"

layout(binding = kClustersBinding, r16ui) readonly uniform uimage2D clusterSamples;

// Counting would otherwise run the shader before the stencil test
layout(early_fragment_tests) in;

layout(location = 0) out vec4 reflection;
layout(location = 1) out uint marks;

void main() {
  uint known = imageLoad(clusterSamples, ivec2(gl_FragCoord.xy)).r;
  known = known == kTracedSample ? 0u : known;
  uint bits = 0u;
  if (known < 2u) {
    // Not a reflective one, or in no cluster
    bits |= known == 1u ? kMaskEnvironment : 0u;
    reflection = vec4(0.0, 0.0, 0.0, known == 1u ? kInCubeMap : 1.0);
  } else {
    int cluster = int(known) - 2;
    vec4 grid = tableOf(cluster, kMore);
    vec2 at = vec2(grid.y - gl_FragCoord.x, gl_FragCoord.y - grid.z) * grid.w;
    ivec3 texel = ivec3(at, int(grid.x));
    vec2 centre = (vec2(texel.xy) + 0.5) * atlasTexel;
    float there = textureLod(depthImages, vec3(centre, grid.x), 0.0).r;
    if (there > 0.0) {
#if EXACT_GRID
      reflection = vec4(imageLoad(colorImages, texel).rgb, 1.0);
#else
      DepthImage image;
      image.place = tableOf(cluster, kPlace);
      image.more = grid;
      image.horizon = tableOf(cluster, kHorizon);
      vec2 inImage = at - image.place.xy;
      float height = aboveHorizon(image, there, floor(inImage) + 0.5);
      reflection = vec4(colorAt(image, inImage, height), 1.0);
#endif
    } else {
      reflection = vec4(0.0, 0.0, 0.0, kBeyondScene);
      bits = kMaskSky;
    }
  }
  marks = marksOf(reflection, bits);
}
