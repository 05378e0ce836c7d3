// What a sample's reads cost: LOADS image loads of four floats, FETCHES texelFetches of depth. For the
// benchmark.
layout(binding = 0, rgba32f) readonly uniform image2D values;
layout(binding = 2) uniform sampler2D depths;

layout(location = 0) out vec4 sum;

void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  sum = vec4(gl_FragCoord.x);
  for (int k = 0; k < LOADS; ++k) sum += imageLoad(values, ivec2(at.x ^ k, at.y));
  for (int k = 0; k < FETCHES; ++k) sum.a += texelFetch(depths, ivec2(at.x ^ k, at.y), 0).r;
}
