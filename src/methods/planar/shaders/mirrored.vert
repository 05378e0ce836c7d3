// The scene as a mirrored eye sees it: what lies behind the mirror is cut off.
#include "raster/shaders/vertex.glsl"

layout(std140, binding = 2) uniform Cut { vec4 plane; } cut;  // kept where dot(plane, (x, 1)) >= 0

// Weights are drawn where depths are equal
invariant gl_Position;

void main() {
  gl_Position = frame.clipFromWorld * vec4(inPosition, 1.0);
  gl_ClipDistance[0] = dot(cut.plane, vec4(inPosition, 1.0));
  passAttributes();
}
