// A level of the pyramid [Uludag2014], cells of 4 x 4 of the finer one: the largest reversed depth, in front of
// which a ray meets nothing, and the smallest that lies `thickness` behind a surface, behind which it does neither.
//   FIRST   1: the frame's depths
//   LAYERS  2: the same of the second layer, in z and w; there a sample without a surface is met by no ray
#if LAYERS == 2
#define Bounds vec4
#define kNothing vec4(0.0, 1.0, 0.0, 1.0)
#else
#define Bounds vec2
#define kNothing vec2(0.0, 1.0)
#endif

#if FIRST
layout(binding = 0) uniform sampler2D depthSamples;
#if LAYERS == 2
layout(binding = 1) uniform sampler2D secondDepths;
#endif
uniform ivec2 size;  // of the frame, in samples
uniform float nearMetres;
uniform float thickness;  // metres

float behind(float depth) { return nearMetres * depth / (nearMetres + thickness * depth); }
#elif LAYERS == 2
layout(binding = 0, rgba32f) readonly uniform image2D finer;
#else
layout(binding = 0, rg32f) readonly uniform image2D finer;
#endif

layout(location = 0) out Bounds bounds;

void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  bounds = kNothing;
#if FIRST
  if (any(greaterThanEqual(at, size))) return;
  bounds.x = texelFetch(depthSamples, at, 0).r;
  bounds.y = behind(bounds.x);
#if LAYERS == 2
  bounds.z = texelFetch(secondDepths, at, 0).r;
  bounds.w = bounds.z > 0.0 ? behind(bounds.z) : 1.0;
#endif
#else
  for (int i = 0; i < 16; ++i) {
    vec4 cell = imageLoad(finer, 4 * at + ivec2(i & 3, i >> 2));
    bounds.x = max(bounds.x, cell.x);
    bounds.y = min(bounds.y, cell.y);
#if LAYERS == 2
    bounds.z = max(bounds.z, cell.z);
    bounds.w = min(bounds.w, cell.w);
#endif
  }
#endif
}
