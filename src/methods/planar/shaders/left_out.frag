// Samples of a plane's mirrors that are not drawn.
//   TRACED  0: they show a cube map as if infinitely far; 1: they are marked to be traced
//   MASKS   1: samples that show the cube map are marked in the masks
#include "raster/shaders/masks.glsl"

layout(binding = 0) uniform usampler2D objectSamples;
layout(binding = 1) uniform usamplerBuffer planes;  // by object id, see region.frag
uniform uint plane;
#if TRACED
layout(location = 0) out uint mark;
#else
uniform mat3 rayFromSample;  // (sample position, 1) to a ray of 1 m along the axis, world space
layout(binding = 2) uniform sampler2D normalSamples;
layout(binding = 3) uniform samplerCube cubeMap;
layout(location = 0) out vec4 reflection;
#if MASKS
layout(location = 1) out uint mask;
#endif
#endif

void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  if (texelFetch(planes, int(texelFetch(objectSamples, at, 0).r)).r != plane) discard;
#if TRACED
  mark = 1u;
#else
  vec3 ray = normalize(rayFromSample * vec3(gl_FragCoord.xy, 1.0));
  vec3 reflected = reflect(ray, texelFetch(normalSamples, at, 0).xyz);
  reflection = vec4(textureLod(cubeMap, reflected, 0.0).rgb, 1.0);
#if MASKS
  mask = kMaskEnvironment;
#endif
#endif
}
