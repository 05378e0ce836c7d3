// What composite must read at least, for the benchmark: SAMPLES x SAMPLES samples of two images.
//   TINTED  1: and the tints of their objects
layout(binding = 0, rgba32f) readonly uniform image2D values;
layout(binding = 1, rgba32f) readonly uniform image2D others;
#if TINTED
layout(binding = 2, r32ui) readonly uniform uimage2D objectSamples;
layout(binding = 5) uniform samplerBuffer tints;
#endif

layout(location = 0) out vec4 sum;

void main() {
  sum = vec4(0.0);
  for (int k = 0; k < SAMPLES * SAMPLES; ++k) {
    ivec2 at = ivec2(gl_FragCoord.xy) * SAMPLES + ivec2(k % SAMPLES, k / SAMPLES);
    sum += imageLoad(values, at);
    sum.rgb += imageLoad(others, at).rgb;
#if TINTED
    sum.rgb += texelFetch(tints, int(imageLoad(objectSamples, at).r)).rgb;
#endif
  }
}
