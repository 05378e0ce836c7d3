#include "broken_part.glsl"
layout(location = 0) out vec4 result;
void main() {
  result = part();
}
