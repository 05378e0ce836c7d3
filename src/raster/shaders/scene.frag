// One surface sample: the G-buffer's values (GBUFFER 1) or its diffuse radiance alone (0). CONSTANT 1:
// the same value everywhere, for benchmarks.
#include "shading.glsl"
#include "varyings.glsl"

struct Slot {
  vec4 linear;  // columns of the 2x2 part of uv' = transform * (uv, 1)
  vec4 offset;  // xy translation; z texels per unit of uv; w last mip level
};
layout(std140, binding = 1) uniform Material {
  vec4 baseColor;      // rgb; a
  vec4 emissive;       // rgb radiance; w alpha cutoff
  vec4 specular;       // s, g, metallic factor, roughness factor
  vec4 more;           // F0 of the dielectric part, scale of the normal map
  Slot baseSlot;
  Slot emissiveSlot;
  Slot normalSlot;
  Slot specularSlot;
} material;

uniform float uvPerMetre;

#if BASE_TEXTURE
layout(binding = 0) uniform sampler2D baseTexture;
#endif
#if NORMAL_MAP
layout(binding = 1) uniform sampler2D normalTexture;
#endif
#if SPECULAR_TEXTURE
layout(binding = 2) uniform sampler2D specularTexture;
#endif
#if EMISSIVE_TEXTURE
layout(binding = 3) uniform sampler2D emissiveTexture;
#endif

#if GBUFFER
uniform uint objectId;  // VIRTUAL: of samples that show what it reflects
layout(location = 0) out vec4 outDiffuse;
layout(location = 1) out vec4 outNormal;
layout(location = 2) out uint outObject;
#else
layout(location = 0) out vec4 outDiffuse;
#endif

#if VIRTUAL
uniform uint reflector;    // id
uniform float depthSlack;  // metres / metres of the near plane
uniform float fresnel;     // 1: by Schlick
uniform float refraction;  // index before the surface / index behind it; 0: it mirrors
uniform uint nextTotal;    // objectId where it reflects totally
layout(binding = 5) uniform usampler2D reflectorSamples;
layout(binding = 6) uniform sampler2D depthSamples;
#endif

#if PEEL
uniform int frontLayer;
layout(binding = 5) uniform sampler2DArray frontDepth;
// Nearer to the first layer, in depth, hence in parallax, nothing is drawn. Ours.
const float kPeelDepth = 1e-3;
#endif

vec2 slotUv(Slot slot, vec2 uv) {
  return slot.linear.xy * uv.x + slot.linear.zw * uv.y + slot.offset.xy;
}

#if UV0
#define UV_OF_0 vertexUv0
#endif
#if UV1
#define UV_OF_1 vertexUv1
#endif
#define UV_OF(set) UV_OF_2(set)
#define UV_OF_2(set) UV_OF_##set

void main() {
#if CONSTANT
  outDiffuse = vec4(0.5);
#if GBUFFER
  outNormal = vec4(0.5);
  outObject = objectId;
#endif
  return;
#endif
#if VIRTUAL
  // On its reflector alone, behind it, and by way of the very place that the sample shows
  float surfaceDepth = texelFetch(depthSamples, ivec2(gl_FragCoord.xy), 0).r;
  if (texelFetch(reflectorSamples, ivec2(gl_FragCoord.xy), 0).r != reflector ||
      gl_FragCoord.z > surfaceDepth ||
      abs(vertexShare / gl_FragCoord.z - 1.0 / surfaceDepth) > depthSlack) {
    discard;
  }
#endif
#if PEEL
  if (gl_FragCoord.z > texelFetch(frontDepth, ivec3(gl_FragCoord.xy, frontLayer), 0).r - kPeelDepth) {
    discard;
  }
#endif
#if ALPHA_MASK
  float alpha = material.baseColor.a;
#if BASE_TEXTURE
  alpha *= textureLod(baseTexture, slotUv(material.baseSlot, UV_OF(BASE_UV)), 0.0).a;
#endif
  if (alpha < material.emissive.w) discard;
#endif

  // Where the sample is, seen from the eye
#if VIRTUAL
  // From the place of the reflection
#if PLACES
  vec4 eye = vec4(vertexPlace, frame.eye.w);
#else
  vec4 ray = frame.rayFromWindow * vec4(gl_FragCoord.xy, surfaceDepth, 1.0);
  vec4 eye = vec4(frame.eye.xyz + ray.xyz / ray.w, frame.eye.w);
#endif
  vec3 fromEye = vertexPosition - eye.xyz;
  vec4 imageRay = frame.rayFromWindow * vec4(gl_FragCoord.xyz, 1.0);
  vec3 image = imageRay.xyz / imageRay.w;
#elif FROM_EYE
#if VIEWS
    vec3 fromEye = vertexFromEye;
#if COMPOUND
  vec4 eye = vertexEye;
#else
  vec4 eye = view.eye;
#endif

#else
  vec4 ray = frame.rayFromWindow * vec4(gl_FragCoord.xyz, 1.0);
  vec3 fromEye = ray.xyz / ray.w;
  vec4 eye = frame.eye;
#endif
#endif

  // Interpolated normal
#if !UNLIT || GBUFFER
  vec3 normal = vertexNormal * inversesqrt(max(dot(vertexNormal, vertexNormal), 1e-20));
#endif

  // Mip levels by a ray cone
#if BASE_TEXTURE || NORMAL_MAP || EMISSIVE_TEXTURE || (SPECULAR_TEXTURE && GBUFFER)
  float distance2 = max(dot(fromEye, fromEye), 1e-20);
#if !UNLIT || GBUFFER
  float nd = abs(dot(normal, fromEye)) * inversesqrt(distance2);
#else
  float nd = 1.0;
#endif
  // The square of uvPerMetre * cone width / sqrt(max(|N.d|, 0.05))
  float uvScale = uvPerMetre * eye.w;
#if VIRTUAL
  distance2 = dot(image, image);
#endif
  float footprint2 = uvScale * uvScale * distance2 / max(nd, 0.05);
#define LEVEL(slot) textureLevel(slot.offset.z * slot.offset.z * footprint2, slot.offset.w)
#endif

  // Shading normal
#if VIRTUAL && (!UNLIT || GBUFFER)
  bool front = dot(normal, fromEye) < 0.0;
#else
  bool front = gl_FrontFacing;
#endif
#if NORMAL_MAP
  vec3 tangent = vertexTangent.xyz * inversesqrt(max(dot(vertexTangent.xyz, vertexTangent.xyz), 1e-20));
  vec3 bitangent = cross(normal, tangent) * vertexTangent.w;
  vec3 m = 2.0 * textureLod(normalTexture, slotUv(material.normalSlot, UV_OF(NORMAL_UV)),
                            LEVEL(material.normalSlot)).xyz - 1.0;
  m.xy *= material.more.y;
  vec3 bent = m.x * tangent + m.y * bitangent + m.z * normal;
  normal = bent * inversesqrt(max(dot(bent, bent), 1e-20));
#endif
#if !UNLIT || GBUFFER
  // ... turned to the viewer (glFrontFace follows views that mirror)
  if (!front) normal = -normal;
#endif

  // Diffuse radiance
  vec3 albedo = material.baseColor.rgb;
#if BASE_TEXTURE
  albedo *= textureLod(baseTexture, slotUv(material.baseSlot, UV_OF(BASE_UV)),
                       LEVEL(material.baseSlot)).rgb;
#endif
#if VERTEX_COLOR
  albedo *= vertexColor;
#endif
#if UNLIT
  vec3 radiance = albedo;
#else
  vec3 irradiance = vec3(0.0);
#if BAKE_IRRADIANCE
  irradiance += vertexIrradiance;
#endif
#if SKY
  vec3 sky = skyIrradiance(normal) + kPi * frame.ambient.rgb;
#if BAKE_VISIBILITY
  sky *= vertexVisibility;
#endif
  irradiance += sky;
#endif
#if LIGHT_COUNT > 0
  irradiance += lightIrradiance(eye.xyz + fromEye, normal);
#endif
  vec3 emissive = material.emissive.rgb;
#if EMISSIVE_TEXTURE
  emissive *= textureLod(emissiveTexture, slotUv(material.emissiveSlot, UV_OF(EMISSIVE_UV)),
                         LEVEL(material.emissiveSlot)).rgb;
#endif
  vec3 radiance = albedo * (1.0 / kPi) * irradiance + emissive;
#endif
  radiance = min(radiance, frame.ambient.www);

#if GBUFFER
  float s = material.specular.x;
  float g = material.specular.y;
#if SPECULAR_TEXTURE
  vec2 texel = textureLod(specularTexture, slotUv(material.specularSlot, UV_OF(SPECULAR_UV)),
                          LEVEL(material.specularSlot)).bg;
  s = specularLevel(material.specular.z * texel.x, material.more.x);
  g = material.specular.w * texel.y;
#endif
#if VIRTUAL
  vec3 direction = normalize(fromEye);
  if (s > 0.0) s += fresnel * (1.0 - s) * pow(clamp(1.0 + dot(direction, normal), 0.0, 1.0), 5.0);
  vec3 onward = refraction > 0.0 ? refract(direction, normal, refraction) : vec3(0.0);
  bool mirrors = onward == vec3(0.0);
  if (mirrors) onward = reflect(direction, normal);
  outNormal = vec4(onward, g);
  outObject = refraction > 0.0 && mirrors ? nextTotal : objectId;
#else
  outNormal = vec4(normal, g);
  outObject = objectId;
#endif
  outDiffuse = vec4(radiance, s);
#else
  outDiffuse = vec4(radiance, 1.0);
#endif
}
