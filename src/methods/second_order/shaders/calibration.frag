// What composite must read at least, for the benchmark: SAMPLES x SAMPLES samples of two images.
layout(binding = 0, rgba32f) readonly uniform image2D values;
layout(binding = 1, rgba32f) readonly uniform image2D others;

layout(location = 0) out vec4 sum;

void main() {
  sum = vec4(0.0);
  for (int k = 0; k < SAMPLES * SAMPLES; ++k) {
    ivec2 at = ivec2(gl_FragCoord.xy) * SAMPLES + ivec2(k % SAMPLES, k / SAMPLES);
    sum += imageLoad(values, at) + imageLoad(others, at);
  }
}
