// Adds what a mirror reflects to the radiance of the mirror: blended as rgb + a * target.
layout(binding = 0) uniform sampler2D weights;  // weights.frag
layout(binding = 1) uniform sampler2D reflected;

layout(location = 0) out vec4 outRadiance;

void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  vec4 weight = texelFetch(weights, at, 0);
  if (weight.a == 0.0) discard;
  outRadiance = vec4(weight.rgb * texelFetch(reflected, at, 0).rgb, weight.a - 1.0);
}
