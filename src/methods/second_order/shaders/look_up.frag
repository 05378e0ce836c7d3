// Radiance along the rays of samples for which the other passes have found nothing, in the tiles
// that have a sample so marked. Apart from the walks: every lane would pay for the look-ups.
#include "raster/shaders/lobe.glsl"
#include "fallback.glsl"
#include "marks.glsl"
#include "samples.glsl"

// What is written, of which only one's own sample is read
layout(binding = kReflectionBinding) uniform sampler2D reflectionSamples;

// Counting would otherwise run the shader before the stencil test
layout(early_fragment_tests) in;

layout(location = 0) out vec4 reflection;

void main() {
  ivec2 sampleAt = ivec2(gl_FragCoord.xy);
  uint known = imageLoad(clusterSamples, sampleAt).r;
  vec4 normalAndG = imageLoad(normalSamples, sampleAt);
  vec3 ray = rayFromPixel * vec3(gl_FragCoord.xy, 1.0);
  vec3 incoming = normalize(ray);
  vec3 mirror = normalize(reflect(incoming, normalAndG.xyz));
  float level = lobeLevel(coneExponent(lobeOf(normalAndG.a), -dot(normalAndG.xyz, incoming)), 1.0);
  float where = texelFetch(reflectionSamples, sampleAt, 0).a;
  if (known == 0u || where > 0.0) discard;
  vec3 position = positionOfSample(ray);
  vec3 radiance = where == kInCubeMap     ? fallback(position, mirror, level)
                  : where == kOverNothing ? overNothing(position, mirror, level)
                                          : environmentRadiance(mirror);
  reflection = vec4(radiance, 1.0);
}
