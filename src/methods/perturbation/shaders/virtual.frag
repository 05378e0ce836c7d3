// An object where a reflector shows it: its diffuse radiance, and what goes on from there.
//   NORMAL_OUTPUT, SPECULAR_OUTPUT  1: s, the direction onward, and the object's id are written, too
//   TINT_OUTPUT                     1: and the tint of what it reflects
#include "raster/shaders/lobe.glsl"
#include "raster/shaders/surface.glsl"
#include "virtual.glsl"
#include "virtual_constants.glsl"

uniform uint reflector;    // id
uniform float depthSlack;  // metres / metres of the near plane
uniform float fresnel;     // 1: by Schlick
uniform float refraction;  // index before the surface / index behind it; 0: it mirrors
uniform uint objectId;     // of samples that show what it reflects
uniform uint nextTotal;    // objectId where it reflects totally
layout(binding = kReflectorUnit) uniform usampler2D reflectorSamples;
layout(binding = kDepthUnit) uniform sampler2D depthSamples;

layout(location = 0) out vec4 outDiffuse;
#if NORMAL_OUTPUT
layout(location = 1) out vec4 outNormal;
layout(location = 2) out uint outObject;
#endif
#if TINT_OUTPUT
layout(location = 3) out vec4 outTint;
#endif

void main() {
  // On its reflector alone, behind it, and by way of the very place that the sample shows. Triangles
  // without an area may have NaN for what is interpolated: no comparison with it holds
  float surfaceDepth = texelFetch(depthSamples, ivec2(gl_FragCoord.xy), 0).r;
  if (texelFetch(reflectorSamples, ivec2(gl_FragCoord.xy), 0).r != reflector ||
      !(gl_FragCoord.z <= surfaceDepth) ||
      !(abs(vertexShare / gl_FragCoord.z - 1.0 / surfaceDepth) <= depthSlack)) {
    discard;
  }
  cutOut();

  // Seen from the place of the reflection
#if PLACES
  vec4 eye = vec4(vertexPlace, frame.eye.w);
#else
  vec4 ray = frame.rayFromWindow * vec4(gl_FragCoord.xy, surfaceDepth, 1.0);
  vec4 eye = vec4(frame.eye.xyz + ray.xyz / ray.w, frame.eye.w);
#endif
  vec3 fromEye = vertexPosition - eye.xyz;
  vec3 image = fragmentFromEye();
  Surface surface =
      surfaceAt(eye, fromEye, dot(image, image), dot(interpolatedNormal(), fromEye) < 0.0);
#if NORMAL_OUTPUT
  vec3 direction = normalize(fromEye);
  float s = surface.s;
  // DEVIATION: of GGX the tint keeps its colour towards the rim
  float atRim = isGgx(surface.lobe) ? surface.tint.a - s : fresnel * (1.0 - s);
  if (s > 0.0) s += atRim * pow(clamp(1.0 + dot(direction, surface.normal), 0.0, 1.0), 5.0);
  vec3 onward = refraction > 0.0 ? refract(direction, surface.normal, refraction) : vec3(0.0);
  bool mirrors = onward == vec3(0.0);
  if (mirrors) onward = reflect(direction, surface.normal);
  outNormal = vec4(onward, surface.lobe);
  outObject = refraction > 0.0 && mirrors ? nextTotal : objectId;
  outDiffuse = vec4(surface.radiance, s);
#if TINT_OUTPUT
  outTint = surface.tint;
#endif
#else
  outDiffuse = vec4(surface.radiance, 1.0);
#endif
}
