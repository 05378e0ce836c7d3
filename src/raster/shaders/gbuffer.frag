// One sample of the G-buffer.
//   TINT_OUTPUT  1: tints differ from place to place on some material, and are written
#include "surface.glsl"

uniform uint objectId;

layout(location = 0) out vec4 outDiffuse;
layout(location = 1) out vec4 outNormal;
layout(location = 2) out uint outObject;
#if TINT_OUTPUT
layout(location = 3) out vec4 outTint;  // of the reflection
#endif

void main() {
  cutOut();
  Surface surface = surfaceSeen();
  outDiffuse = vec4(surface.radiance, surface.s);
  outNormal = vec4(surface.normal, surface.g);
  outObject = objectId;
#if TINT_OUTPUT
  outTint = vec4(surface.tint, 1.0);
#endif
}
