// The reflection at each probe, one beside the other in rows of kProbesAcross.
#include "constants.glsl"

layout(binding = kReflectionBinding) uniform sampler2D reflectionSamples;
layout(binding = kTilesBinding) uniform usamplerBuffer probePlaces;  // x | y << 16, of samples

uniform int probeCount;

layout(location = 0) out vec4 shown;

void main() {
  int probe = int(gl_FragCoord.y) * kProbesAcross + int(gl_FragCoord.x);
  uint place = texelFetch(probePlaces, min(probe, probeCount - 1)).r;
  shown = texelFetch(reflectionSamples, ivec2(place & 0xFFFFu, place >> 16), 0);
}
