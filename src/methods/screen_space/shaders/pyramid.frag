// A level of the pyramid [Uludag2014], cells of 4 x 4 of the finer one: the largest reversed depth, in front of
// which a ray meets nothing, and the smallest that lies `thickness` behind a surface, behind which it does neither.
//   FIRST  1: the frame's depths
#if FIRST
layout(binding = 0) uniform sampler2D depthSamples;
uniform ivec2 size;  // of the frame, in samples
uniform float nearMetres;
uniform float thickness;  // metres
#else
layout(binding = 0, rg32f) readonly uniform image2D finer;
#endif

layout(location = 0) out vec2 bounds;

void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
#if FIRST
  bool within = all(lessThan(at, size));
  float depth = within ? texelFetch(depthSamples, at, 0).r : 0.0;
  bounds = vec2(depth, within ? nearMetres * depth / (nearMetres + thickness * depth) : 1.0);
#else
  bounds = vec2(0.0, 1.0);
  for (int i = 0; i < 16; ++i) {
    vec2 cell = imageLoad(finer, 4 * at + ivec2(i & 3, i >> 2)).rg;
    bounds = vec2(max(bounds.x, cell.x), min(bounds.y, cell.y));
  }
#endif
}
