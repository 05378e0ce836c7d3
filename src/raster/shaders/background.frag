// Radiance of the environment where no surface is: alpha 0.
#include "environment.glsl"

layout(location = 0) out vec4 outDiffuse;

void main() {
  outDiffuse = vec4(environmentSeen(), 0.0);
}
