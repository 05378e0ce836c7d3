// What the frame shows at each sample, and 1; 0 where it shows nothing: the first level of the colours of cones.
layout(binding = 0) uniform sampler2D diffuseSamples;
uniform ivec2 size;  // of the frame, in samples

layout(location = 0) out vec4 colour;

void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  vec4 shown = all(lessThan(at, size)) ? texelFetch(diffuseSamples, at, 0) : vec4(-1.0);
  colour = shown.a >= 0.0 ? vec4(shown.rgb, 1.0) : vec4(0.0);
}
