// A sample of the G-buffer without a surface: radiance of the environment, and -1 instead of an s.
#include "environment.glsl"

layout(location = 0) out vec4 outDiffuse;
layout(location = 1) out vec4 outNormal;
layout(location = 2) out uint outObject;
layout(location = 3) out vec4 outTint;  // where the G-buffer has tints

void main() {
  outDiffuse = vec4(environmentSeen(), -1.0);
  outNormal = vec4(0.0);
  outObject = 0u;
  outTint = vec4(1.0);
}
