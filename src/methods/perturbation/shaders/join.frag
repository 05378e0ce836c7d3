// What a reflector shows that another one shows, onto the samples of that one: blended by its s, which is
// their alpha.
//   TINT_SAMPLES  1: tints differ from sample to sample
layout(binding = 0) uniform sampler2D reflectionSamples;
#if TINT_SAMPLES
layout(binding = 1) uniform sampler2D tintSamples;
#else
layout(binding = 1) uniform usampler2D reflectorSamples;
layout(binding = 2) uniform samplerBuffer tints;  // by a reflector's number
#endif

layout(location = 0) out vec4 color;

void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
#if TINT_SAMPLES
  vec3 tint = texelFetch(tintSamples, at, 0).rgb;
#else
  vec3 tint = texelFetch(tints, int(texelFetch(reflectorSamples, at, 0).r)).rgb;
#endif
  color = vec4(tint * texelFetch(reflectionSamples, at, 0).rgb, 1.0);
}
