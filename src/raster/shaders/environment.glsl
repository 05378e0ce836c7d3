// The environment as the eye of `frame` sees it.
#include "shading.glsl"

vec3 environmentSeen() {
  vec3 direction = normalize((frame.rayFromWindow * vec4(gl_FragCoord.xy, 0.0, 1.0)).xyz);
  return min(environmentRadiance(direction), frame.ambient.www);
}
