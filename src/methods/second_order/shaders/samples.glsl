// The frame's samples: their clusters, their places, and what they reflect.
// Images where they can be (depth cannot), not textures: llvmpipe loads from them in half the time.
#include "constants.glsl"

layout(binding = kClustersBinding, r16ui) readonly uniform uimage2D clusterSamples;
// xyz shading normal, a = g
layout(binding = kNormalsBinding, rgba32f) readonly uniform image2D normalSamples;
layout(binding = kDepthsBinding) uniform sampler2D depthSamples;  // reversed-Z
layout(binding = kDiffuseBinding, rgba32f) readonly uniform image2D diffuseSamples;

uniform mat3 rayFromPixel;  // (sample position, 1) to a ray that advances 1 m along the axis
uniform mat3 pixelFromRay;  // its inverse
uniform float nearMetres;
uniform vec2 sampleSize;  // 1 / samples of the frame

float depthOfSample(vec2 at) { return textureLod(depthSamples, at * sampleSize, 0.0).r; }

// Of this fragment's sample, from the eye; `ray` is its own.
vec3 positionOfSample(vec3 ray) {
  return ray * (nearMetres / max(depthOfSample(gl_FragCoord.xy), 1e-30));
}
