// What a reflector shows that another one shows, onto the samples of that one: blended by its s, which is
// their alpha.
layout(binding = 0) uniform sampler2D reflectionSamples;
layout(binding = 1) uniform usampler2D reflectorSamples;
layout(binding = 2) uniform samplerBuffer tints;  // by a reflector's number

layout(location = 0) out vec4 color;

void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  vec3 tint = texelFetch(tints, int(texelFetch(reflectorSamples, at, 0).r)).rgb;
  color = vec4(tint * texelFetch(reflectionSamples, at, 0).rgb, 1.0);
}
