// What the walks of mirror rays read (RECORD of walk.glsl), for reads.frag.
#include "methods/second_order/shaders/samples.glsl"
#include "methods/second_order/shaders/walk.glsl"

layout(early_fragment_tests) in;

layout(location = 0) out vec4 reflection;

void main() {
  ivec2 sampleAt = ivec2(gl_FragCoord.xy);
  uint known = imageLoad(clusterSamples, sampleAt).r;
  if (known >= 2u) {
    vec3 ray = rayFromPixel * vec3(gl_FragCoord.xy, 1.0);
    vec3 mirror = normalize(reflect(normalize(ray), imageLoad(normalSamples, sampleAt).xyz));
    DepthImage image = depthImage(int(known) - 2);
    walk(image, startAt(image, positionOfSample(ray)), mirror, farthest);
  }
  reflection = walked;
}
