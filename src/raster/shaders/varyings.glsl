// What goes from vertices to fragments: only what the variant uses (each varying costs time per
// triangle and per sample on llvmpipe). VARYING is `out` or `in`.
#ifdef VERTEX_STAGE
#define VARYING out
#else
#define VARYING in
#endif
#define FROM_EYE (BASE_TEXTURE || NORMAL_MAP || EMISSIVE_TEXTURE || (SPECULAR_TEXTURE && GBUFFER) || (LIGHT_COUNT > 0 && !UNLIT))
#if VIEWS
// One of many views
#if COMPOUND
struct ViewOfMany {
#else
layout(std140, binding = 2) uniform View {
#endif
  mat4 clipFromWorld;
  vec4 eye;      // xyz; w spread of one sample's ray cone in radians
  vec4 ownClip;  // of the object behind which the eye is: drawn in front of it
#if COMPOUND
  vec4 place;    // of its rectangle in the layer's clip space: scale, centre
};
layout(std140, binding = 2) uniform Views { ViewOfMany views[128]; };  // kCompoundViews
#if FROM_EYE
flat VARYING vec4 vertexEye;
#endif
#else
} view;
#endif
#if FROM_EYE
VARYING vec3 vertexFromEye;
#endif
#endif
#if VIRTUAL
VARYING vec3 vertexPosition;
VARYING float vertexShare;
#if PLACES
VARYING vec3 vertexPlace;
#endif
#endif
#if !UNLIT || GBUFFER
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
