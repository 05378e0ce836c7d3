// Marks the samples on which something that moves hides the reflector that stands still there.
layout(binding = 0) uniform usampler2D reflectors;  // of all, by number
layout(binding = 1) uniform usampler2D stillReflectors;

layout(location = 2) out uint reflector;

void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  if (texelFetch(reflectors, at, 0).r == texelFetch(stillReflectors, at, 0).r) discard;
  reflector = 0u;
}
