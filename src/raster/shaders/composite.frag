// Samples to pixels: mean of (1 - s) diffuse + s tint (reflection + highlight); a = share of samples that are
// not background.
//   SAMPLES   per axis
//   REFLECTIVE 0 when nothing of the scene reflects: the mean of the diffuse radiance
//   TINTED    0 when all reflective materials have tint and F90 1; 1: each object has its own; 2: each sample
//   HIGHLIGHTS 1: there are highlights of lights
//   FRESNEL   1: s + (1 - s)(1 - cos)^5 [Schlick1994] where s > 0; not of GGX lobes
//   GGX       1: some lobes are GGX', with Schlick's term (trace::reflectionWeights)
#include "constants.glsl"
#if GGX
#include "lobe.glsl"
#endif

// Images, not textures: llvmpipe loads from them in half the time of texelFetch
layout(binding = kDiffuseImage, rgba32f) readonly uniform image2D diffuseSamples;
#if TINTED == 1
layout(binding = kObjectImage, r32ui) readonly uniform uimage2D objectSamples;
layout(binding = kTintsUnit) uniform samplerBuffer tints;  // by object id
#elif TINTED == 2
layout(binding = kTintImage, rgba32f) readonly uniform image2D tintSamples;
#endif
#if HIGHLIGHTS
layout(binding = kHighlightImage, rgba32f) readonly uniform image2D highlightSamples;
#endif
layout(binding = kReflectionImage, rgba32f) readonly uniform image2D reflectionSamples;
layout(binding = kNormalImage, rgba32f) readonly uniform image2D normalSamples;
uniform mat4 rayFromWindow;

layout(location = 0) out vec4 outFrame;

void main() {
  ivec2 corner = ivec2(gl_FragCoord.xy) * SAMPLES;
  vec4 sum = vec4(0.0);
  for (int j = 0; j < SAMPLES; ++j) {
    for (int i = 0; i < SAMPLES; ++i) {
      ivec2 at = corner + ivec2(i, j);
      vec4 diffuse = imageLoad(diffuseSamples, at);
#if REFLECTIVE
      vec3 reflected = imageLoad(reflectionSamples, at).rgb;
#if HIGHLIGHTS
      reflected += imageLoad(highlightSamples, at).rgb;
#endif
#if GGX
      vec3 atRim = reflected;
#endif
#if TINTED == 1
      vec4 tint = texelFetch(tints, int(imageLoad(objectSamples, at).r));
#elif TINTED == 2
      vec4 tint = imageLoad(tintSamples, at);
#endif
#if TINTED
      reflected *= tint.rgb;
#if GGX
      atRim = tint.a * atRim + (1.0 - tint.a) * diffuse.rgb;
#endif
#endif
      float s = diffuse.a;
#if FRESNEL || GGX
      vec3 d = normalize((rayFromWindow * vec4(vec2(at) + 0.5, 0.0, 1.0)).xyz);
      vec4 normalAndLobe = imageLoad(normalSamples, at);
#if GGX
      bool ggx = isGgx(lobeOf(normalAndLobe.a));
#else
      const bool ggx = false;
#endif
#endif
#if FRESNEL
      float c = clamp(1.0 + dot(d, normalAndLobe.xyz), 0.0, 1.0);
      s += s > 0.0 && !ggx ? (1.0 - s) * (c * c) * (c * c) * c : 0.0;
#endif
      // What lies in the reflection target of a sample that does not reflect is nobody's business
      vec3 color = s > 0.0 ? (1.0 - s) * diffuse.rgb + s * reflected : diffuse.rgb;
#if GGX
      float p = meanSchlick(lobeOf(normalAndLobe.a) - 2.0, -dot(d, normalAndLobe.xyz));
      color = ggx && s > 0.0 ? (1.0 - p) * color + p * atRim : color;
#endif
#else
      vec3 color = diffuse.rgb;
#endif
      sum += vec4(color, diffuse.a >= 0.0 ? 1.0 : 0.0);
    }
  }
  outFrame = sum * (1.0 / float(SAMPLES * SAMPLES));
}
