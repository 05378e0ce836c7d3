// Passes the samples of one plane's mirrors, so that their depths can be set.
//   NESTED  0: by the objects of the G-buffer; 1: by the weights of a view
#if NESTED
layout(binding = 0) uniform sampler2D weights;
#else
layout(binding = 0) uniform usampler2D objectSamples;
layout(binding = 1) uniform usamplerBuffer planes;  // by object id: from 1; 0: none of the method's
uniform uint plane;
#endif

void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
#if NESTED
  if (texelFetch(weights, at, 0).a == 0.0) discard;
#else
  uint object = texelFetch(objectSamples, at, 0).r;
  if (texelFetch(planes, int(object)).r != plane) discard;
#endif
}
