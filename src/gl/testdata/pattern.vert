// Two triangles' worth of corners from gl_VertexID, at a depth given by a uniform.
#include "corners.glsl"
uniform float depth;
uniform vec4 rectangle;  // left, bottom, right, top in clip space
void main() {
  vec2 corner = cornerOf(gl_VertexID);
  gl_Position = vec4(mix(rectangle.xy, rectangle.zw, corner), depth, 1.0);
}
