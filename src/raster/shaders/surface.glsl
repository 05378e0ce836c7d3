// What fragments of the scene's surfaces have in common; entry points (gbuffer.frag, diffuse.frag, those
// of methods) say where the eye is and what is written.
#include "shading.glsl"
#include "varyings.glsl"

#ifndef FACTORS
#define FACTORS 0
#endif

struct Slot {
  vec4 linear;  // columns of the 2x2 part of uv' = transform * (uv, 1)
  vec4 offset;  // xy translation; z texels per unit of uv; w last mip level
};
layout(std140, binding = kMaterialBlock) uniform Material {
  vec4 baseColor;      // rgb; a
  vec4 emissive;       // rgb radiance; w alpha cutoff
  vec4 specular;       // s, g, metallic factor, roughness factor
  vec4 dielectric;     // F0 and F90 of the dielectric part
  vec4 more;           // scale of the normal map, lobe of roughness 0
  vec4 tint;           // of the reflection: rgb + a * albedo
  Slot baseSlot;
  Slot emissiveSlot;
  Slot normalSlot;
  Slot specularSlot;
} material;

uniform float uvPerMetre;

#if BASE_TEXTURE
layout(binding = kBaseTextureUnit) uniform sampler2D baseTexture;
#endif
#if NORMAL_MAP
layout(binding = kNormalTextureUnit) uniform sampler2D normalTexture;
#endif
#if SPECULAR_TEXTURE
layout(binding = kSpecularTextureUnit) uniform sampler2D specularTexture;
#endif
#if EMISSIVE_TEXTURE
layout(binding = kEmissiveTextureUnit) uniform sampler2D emissiveTexture;
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

// Discards what an alpha mask cuts out.
void cutOut() {
#if ALPHA_MASK
  float alpha = material.baseColor.a;
#if BASE_TEXTURE
  alpha *= textureLod(baseTexture, slotUv(material.baseSlot, UV_OF(BASE_UV)), 0.0).a;
#endif
  if (alpha < material.emissive.w) discard;
#endif
}

// From the eye of `frame` to what a fragment shows.
vec3 fragmentFromEye() {
  vec4 ray = frame.rayFromWindow * vec4(gl_FragCoord.xyz, 1.0);
  return ray.xyz / ray.w;
}

// The unit normal of the triangles' vertices; 0 where nobody needs it.
vec3 interpolatedNormal() {
#if HAS_NORMAL
  return vertexNormal * inversesqrt(max(dot(vertexNormal, vertexNormal), 1e-20));
#else
  return vec3(0.0);
#endif
}

// A ray cone's width on the surface, in units of uv: its square, by the cosine of the normal.
float coneFootprint2(vec4 eye, vec3 fromEye, float coneLength2, vec3 normal) {
#if HAS_NORMAL
  float nd = abs(dot(normal, fromEye)) * inversesqrt(max(dot(fromEye, fromEye), 1e-20));
#else
  float nd = 1.0;
#endif
  // The square of uvPerMetre * cone width / sqrt(max(|N.d|, 0.05))
  float uvScale = uvPerMetre * eye.w;
  return uvScale * uvScale * coneLength2 / max(nd, 0.05);
}

float slotLevel(Slot slot, float footprint2) {
  return textureLevel(slot.offset.z * slot.offset.z * footprint2, slot.offset.w);
}

// The unit shading normal of the front: a normal map's where there is one, `offset` texels away.
vec3 mappedNormal(vec3 normal, float level, vec2 offset) {
#if NORMAL_MAP
  vec3 tangent = vertexTangent.xyz * inversesqrt(max(dot(vertexTangent.xyz, vertexTangent.xyz), 1e-20));
  vec3 bitangent = cross(normal, tangent) * vertexTangent.w;
  vec2 place = slotUv(material.normalSlot, UV_OF(NORMAL_UV)) + offset / vec2(textureSize(normalTexture, 0));
  vec3 m = 2.0 * textureLod(normalTexture, place, level).xyz - 1.0;
  m.xy *= material.more.x;
  vec3 bent = m.x * tangent + m.y * bitangent + m.z * normal;
  return bent * inversesqrt(max(dot(bent, bent), 1e-20));
#else
  return normal;
#endif
}

// Irradiance at a place by what is baked, the sky and the lights; with FACTORS by what is baked alone.
vec3 surfaceIrradiance(vec3 place, vec3 normal) {
  vec3 irradiance = vec3(0.0);
#if BAKE_IRRADIANCE && !UNLIT
  irradiance += vertexIrradiance;
#endif
#if SKY && !FACTORS
  vec3 sky = skyIrradiance(normal) + kPi * frame.ambient.rgb;
#if BAKE_VISIBILITY && !UNLIT
  sky *= vertexVisibility;
#endif
  irradiance += sky;
#endif
#if LIGHT_COUNT > 0 && !FACTORS
  irradiance += lightIrradiance(place, normal);
#endif
  return irradiance;
}

vec3 surfaceAlbedo(float footprint2) {
  vec3 albedo = material.baseColor.rgb;
#if BASE_TEXTURE
  albedo *= textureLod(baseTexture, slotUv(material.baseSlot, UV_OF(BASE_UV)),
                       slotLevel(material.baseSlot, footprint2)).rgb;
#endif
#if VERTEX_COLOR
  albedo *= vertexColor;
#endif
  return albedo;
}

vec3 diffuseRadiance(vec3 place, vec3 normal, vec3 albedo, float footprint2) {
#if UNLIT
  vec3 radiance = albedo;
#else
  vec3 emissive = material.emissive.rgb;
#if EMISSIVE_TEXTURE
  emissive *= textureLod(emissiveTexture, slotUv(material.emissiveSlot, UV_OF(EMISSIVE_UV)),
                         slotLevel(material.emissiveSlot, footprint2)).rgb;
#endif
  vec3 radiance = albedo * (1.0 / kPi) * surfaceIrradiance(place, normal) + emissive;
#endif
  return min(radiance, frame.ambient.www);
}

// s, the lobe (lobe.glsl) and metallic.
vec3 specularAndGloss(float footprint2) {
#if SPECULAR_TEXTURE && SPECULAR_OUTPUT
  vec2 texel = textureLod(specularTexture, slotUv(material.specularSlot, UV_OF(SPECULAR_UV)),
                          slotLevel(material.specularSlot, footprint2)).bg;
  float metallic = material.specular.z * texel.x;
  return vec3(specularLevel(metallic, material.dielectric.rgb, material.more.y),
              material.specular.w * texel.y + material.more.y, metallic);
#else
  return material.specular.xyz + vec3(0.0, material.more.y, 0.0);
#endif
}

// What the reflection is multiplied with beside s; a: F90.
vec4 reflectionTint(float metallic, vec3 albedo) {
  float f90 = 1.0 - (1.0 - metallic) * (1.0 - material.dielectric.a);
#if SPECULAR_TEXTURE && TINT_OUTPUT
  vec3 plain = (1.0 - metallic) * material.dielectric.rgb;
  float s = metallic + max(max(plain.x, plain.y), plain.z);
  vec3 byTexel = s > 0.0 ? plain / s + metallic / s * albedo : vec3(1.0);
  return vec4(material.tint.a > 0.0 ? byTexel : material.tint.rgb, f90);
#else
  return vec4(material.tint.rgb + material.tint.a * albedo, f90);
#endif
}

struct Surface {
  vec3 radiance;  // diffuse, before any factor 1 - s
  vec3 normal;    // unit shading normal turned to the viewer; 0 where nobody needs it
  float s;
  float lobe;
  vec4 tint;  // rgb: of the reflection, valid with TINT_OUTPUT alone; a: F90
  vec3 albedo;
};

// The surface that a fragment shows. eye: xyz, w spread of its ray cones; coneLength2: the square of
// their length; front: whether the surface's front is seen.
Surface surfaceAt(vec4 eye, vec3 fromEye, float coneLength2, bool front) {
  vec3 normal = interpolatedNormal();
  float footprint2 = coneFootprint2(eye, fromEye, coneLength2, normal);
  normal = mappedNormal(normal, slotLevel(material.normalSlot, footprint2), vec2(0.0));
  if (!front) normal = -normal;
  vec3 albedo = surfaceAlbedo(footprint2);
  vec3 specular = specularAndGloss(footprint2);
  return Surface(diffuseRadiance(eye.xyz + fromEye, normal, albedo, footprint2), normal, specular.x,
                 specular.y, reflectionTint(specular.z, albedo), albedo);
}

// ... as the eye of `frame` sees it (glFrontFace follows views that mirror).
Surface surfaceSeen() {
  vec3 fromEye = fragmentFromEye();
  return surfaceAt(frame.eye, fromEye, max(dot(fromEye, fromEye), 1e-20), gl_FrontFacing);
}
