// Marks the cube maps that reflective samples read.
#include "methods/environment_map/shaders/probes.glsl"

uniform mat3 rayFromSample;  // (sample position, 1) to a ray of 1 m along the axis, world space

layout(early_fragment_tests) in;
layout(std430, binding = 0) buffer Reads { uint isRead[PROBES]; };

void main() {
#if BLEND
  ivec2 maps;
  vec3 place = placeOf(rayFromSample * vec3(gl_FragCoord.xy, 1.0));
  float second = nearestCentres(place, maps).y;
  // With a margin: the look-up may round otherwise, and take another one for the second nearest
  for (int i = 0; i < PROBES; ++i)
    if (distance(place, centres[i]) <= 1.001 * second) isRead[i] = 1u;
#else
  isRead[mapOfObject()] = 1u;
#endif
}
