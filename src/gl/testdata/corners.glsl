// Corners of a strip: 0..1.
vec2 cornerOf(int vertex) {
  return vec2(vertex & 1, vertex >> 1);
}
