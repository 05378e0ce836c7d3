layout(location = 0) out vec4 result;
void main() {
  result = vec4(gl_FragCoord.xy, 0.0, 1.0);
}
