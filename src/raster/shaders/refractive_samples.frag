// Passes the samples that show a surface that refracts, to be counted or marked.
layout(binding = 0) uniform usampler2D objectSamples;
layout(binding = 1) uniform usamplerBuffer refracts;  // by object id

layout(location = 0) out uint marked;

void main() {
  uint object = texelFetch(objectSamples, ivec2(gl_FragCoord.xy), 0).r;
  if (texelFetch(refracts, int(object)).r == 0u) discard;
  marked = object;
}
