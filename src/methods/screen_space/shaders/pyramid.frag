// A level of the pyramid of nearest depths [Uludag2014]: the largest reversed depth of a cell.
//   FIRST  1: the frame's depths, 0 beyond the frame
#if FIRST
layout(binding = 0) uniform sampler2D depthSamples;
uniform ivec2 size;  // of the frame, in samples
#else
layout(binding = 0, r32f) readonly uniform image2D finer;
#endif

layout(location = 0) out float nearest;

void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
#if FIRST
  nearest = all(lessThan(at, size)) ? texelFetch(depthSamples, at, 0).r : 0.0;
#else
  at *= 2;
  nearest = max(max(imageLoad(finer, at).r, imageLoad(finer, at + ivec2(1, 0)).r),
                max(imageLoad(finer, at + ivec2(0, 1)).r, imageLoad(finer, at + ivec2(1, 1)).r));
#endif
}
