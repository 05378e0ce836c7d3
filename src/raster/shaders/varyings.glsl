// What goes from vertices to fragments of surfaces: only what the variant uses (each varying costs time
// per triangle and per sample on llvmpipe). VARYING is `out` or `in`.
//   NORMAL_OUTPUT    1 when the shading normal is written, also that of unlit surfaces
//   SPECULAR_OUTPUT  1 when s and g are written
#ifdef VERTEX_STAGE
#define VARYING out
#else
#define VARYING in
#endif
#define HAS_NORMAL (!UNLIT || NORMAL_OUTPUT)
// Whether the way from the eye matters
#define FROM_EYE (BASE_TEXTURE || NORMAL_MAP || EMISSIVE_TEXTURE || (SPECULAR_TEXTURE && SPECULAR_OUTPUT) || (LIGHT_COUNT > 0 && !UNLIT))
#if HAS_NORMAL
VARYING vec3 vertexNormal;
#endif
#if NORMAL_MAP
VARYING vec4 vertexTangent;
#endif
#if UV0
VARYING vec2 vertexUv0;
#endif
#if UV1
VARYING vec2 vertexUv1;
#endif
#if VERTEX_COLOR
VARYING vec3 vertexColor;
#endif
#if BAKE_IRRADIANCE && !UNLIT
VARYING vec3 vertexIrradiance;
#endif
#if BAKE_VISIBILITY && SKY && !UNLIT
VARYING float vertexVisibility;
#endif
