// The scene as one view shows it.
#include "vertex.glsl"

void main() {
  gl_Position = frame.clipFromWorld * vec4(inPosition, 1.0);
  passAttributes();
}
