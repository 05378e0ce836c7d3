layout(location = 0) out vec4 result;
in vec3 nobodyWritesThis;
vec4 declaredOnly(vec3 v);
void main() {
  result = declaredOnly(nobodyWritesThis);
}
