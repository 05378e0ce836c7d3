// Chosen values of the surfaces of any view. Locations count the outputs that there are.
//   RADIANCE_OUTPUT  1: diffuse radiance, alpha 1
//   BEHIND           1: of what lies behind other depths alone
//   FACTORS          1: the radiance has no sky and no lights; what these are multiplied with is written
#include "surface.glsl"
#if BEHIND
#include "constants.glsl"
layout(binding = kFirstPassUnit) uniform sampler2D depthsBefore;
const float kApart = 1e-4;  // of depth, which is 1 at the near plane and 0 at the far one; ours
#endif

#if RADIANCE_OUTPUT
layout(location = 0) out vec4 outDiffuse;
#endif
#if NORMAL_OUTPUT
layout(location = RADIANCE_OUTPUT) out vec4 outNormal;  // alpha 1
#endif
#if SPECULAR_OUTPUT
layout(location = RADIANCE_OUTPUT + NORMAL_OUTPUT) out vec4 outSpecular;  // s, g, 0, alpha 1
#endif
#if FACTORS
layout(location = RADIANCE_OUTPUT + NORMAL_OUTPUT + SPECULAR_OUTPUT) out vec4 outFactors;
#endif

void main() {
#if BEHIND
  if (gl_FragCoord.z + kApart >= texelFetch(depthsBefore, ivec2(gl_FragCoord.xy), 0).r) discard;
#endif
  cutOut();
  Surface surface = surfaceSeen();
#if RADIANCE_OUTPUT
  outDiffuse = vec4(surface.radiance, 1.0);
#endif
#if NORMAL_OUTPUT
  outNormal = vec4(surface.normal, 1.0);
#endif
#if SPECULAR_OUTPUT
  outSpecular = vec4(surface.s, surface.lobe, 0.0, 1.0);
#endif
#if FACTORS && UNLIT
  outFactors = vec4(0.0);
#elif FACTORS && BAKE_VISIBILITY && SKY
  outFactors = vec4(surface.albedo / kPi, vertexVisibility);
#elif FACTORS
  outFactors = vec4(surface.albedo / kPi, 1.0);
#endif
}
