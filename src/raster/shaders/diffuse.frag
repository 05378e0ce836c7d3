// Chosen values of the surfaces of any view. Locations count the outputs that there are.
//   RADIANCE_OUTPUT  1: diffuse radiance, alpha 1
#include "surface.glsl"

#if RADIANCE_OUTPUT
layout(location = 0) out vec4 outDiffuse;
#endif
#if NORMAL_OUTPUT
layout(location = RADIANCE_OUTPUT) out vec4 outNormal;  // alpha 1
#endif
#if SPECULAR_OUTPUT
layout(location = RADIANCE_OUTPUT + NORMAL_OUTPUT) out vec4 outSpecular;  // s, g, 0, alpha 1
#endif

void main() {
  cutOut();
  Surface surface = surfaceSeen();
#if RADIANCE_OUTPUT
  outDiffuse = vec4(surface.radiance, 1.0);
#endif
#if NORMAL_OUTPUT
  outNormal = vec4(surface.normal, 1.0);
#endif
#if SPECULAR_OUTPUT
  outSpecular = vec4(surface.s, surface.g, 0.0, 1.0);
#endif
}
