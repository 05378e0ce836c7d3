// Passes samples, for the stencil alone.
//   OTHERS  1: only those of other methods' reflectors
#if OTHERS
layout(binding = 0) uniform usampler2D objectSamples;
layout(binding = 1) uniform usamplerBuffer own;  // by object id
#endif

void main() {
#if OTHERS
  uint object = texelFetch(objectSamples, ivec2(gl_FragCoord.xy), 0).r;
  if (texelFetch(own, int(object)).r != 0u) discard;
#endif
}
