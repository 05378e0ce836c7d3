#include "gl/testdata/corners.glsl"
uniform vec4 color;
uniform float unused;
layout(location = 0) out vec4 result;
void main() {
#ifdef SCALE
  result = color * SCALE;
#else
  result = color;
#endif
}
