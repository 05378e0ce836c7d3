// One sample of the G-buffer.
#include "surface.glsl"

uniform uint objectId;

layout(location = 0) out vec4 outDiffuse;
layout(location = 1) out vec4 outNormal;
layout(location = 2) out uint outObject;

void main() {
  cutOut();
  Surface surface = surfaceSeen();
  outDiffuse = vec4(surface.radiance, surface.s);
  outNormal = vec4(surface.normal, surface.g);
  outObject = objectId;
}
