#include "corners.glsl"
layout(location = 0) out vec4 result;
void main() {
  // The error stands on line 5.
  result = undefinedName;
}
