// What vertices of the scene have in common; entry points (scene.vert, those of methods) say where
// they appear. Positions are in world space already.
#include "shading.glsl"
#define VERTEX_STAGE
#include "varyings.glsl"

layout(location = kPositionAttribute) in vec3 inPosition;
layout(location = kNormalAttribute) in vec3 inNormal;
layout(location = kTangentAttribute) in vec4 inTangent;
layout(location = kUv0Attribute) in vec2 inUv0;
layout(location = kUv1Attribute) in vec2 inUv1;
layout(location = kColorAttribute) in vec3 inColor;
layout(location = kBakeAttribute) in vec4 inBake;

void passAttributes() {
#if HAS_NORMAL
  vertexNormal = inNormal;
#endif
#if NORMAL_MAP
  vertexTangent = inTangent;
#endif
#if UV0
  vertexUv0 = inUv0;
#endif
#if UV1
  vertexUv1 = inUv1;
#endif
#if VERTEX_COLOR
  vertexColor = inColor;
#endif
#if BAKE_IRRADIANCE && !UNLIT
  vertexIrradiance = inBake.rgb;
#endif
#if BAKE_VISIBILITY && SKY && !UNLIT
  vertexVisibility = inBake.a;
#endif
}
