// Radiance of the environment where nothing is: a = -1 instead of an s in the G-buffer, coverage 0
// elsewhere.
#include "shading.glsl"

layout(location = 0) out vec4 outDiffuse;
#if GBUFFER
layout(location = 1) out vec4 outNormal;
layout(location = 2) out uint outObject;
#endif

void main() {
  vec3 direction = normalize((frame.rayFromWindow * vec4(gl_FragCoord.xy, 0.0, 1.0)).xyz);
  outDiffuse = vec4(min(environmentRadiance(direction), frame.ambient.www), GBUFFER != 0 ? -1.0 : 0.0);
#if GBUFFER
  outNormal = vec4(0.0);
  outObject = 0u;
#endif
}
