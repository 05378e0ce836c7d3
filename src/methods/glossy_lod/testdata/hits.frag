// What given rays meet, one a pixel: distance, nodes visited, back, and the mip level there.
#include "raster/shaders/shading.glsl"
#include "../shaders/traverse.glsl"
#include "../shaders/filter.glsl"

layout(binding = kNormalsUnit) uniform sampler2D origins;     // xyz; a = width's slope
layout(binding = kDepthsUnit) uniform sampler2D directions;  // xyz, unit
uniform float alphaOfAll;

layout(location = 0) out vec4 result;

void main() {
  vec4 origin = texelFetch(origins, ivec2(gl_FragCoord.xy), 0);
  vec3 direction = texelFetch(directions, ivec2(gl_FragCoord.xy), 0).xyz;
  Visits visits = Visits(0u, 0u, 0u);
  Width width = Width(0.0, origin.a);
  Found found = traverse(origin.xyz, direction, width, alphaOfAll, visits);
  bool missed = found.node == kNothing;
  float level = missed ? -1.0 : levelOf(found, direction, width.slope * found.metres);
  result = vec4(missed ? -1.0 : found.metres, float(visits.nodes), found.back ? 1.0 : 0.0, level);
}
