// A fixed amount of work per pixel: what benchmarks divide their times by. Never change it.
layout(location = 0) out vec4 outColor;

void main() {
  vec2 x = gl_FragCoord.xy * (1.0 / 1024.0);
  outColor = vec4(x, x.x * x.y, sqrt(x.x + x.y));
}
