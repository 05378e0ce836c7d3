// Adds to the masks what they were before another method rendered the samples that were left to it.
#include "raster/shaders/masks.glsl"

layout(binding = 0) uniform usampler2D before;
layout(binding = 1) uniform usampler2D left;  // object ids; 0: not left
layout(binding = 0, r16ui) uniform uimage2D masks;

void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  uint marks = texelFetch(left, at, 0).r != 0u ? kMaskFallback : 0u;
  uint bits = imageLoad(masks, at).r | texelFetch(before, at, 0).r | marks;
  imageStore(masks, at, uvec4(bits));
}
