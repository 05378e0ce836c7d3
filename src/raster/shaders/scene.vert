// Vertices of the scene, already in world space.
#include "shading.glsl"

layout(location = 0) in vec3 inPosition;
layout(location = 1) in vec3 inNormal;
layout(location = 2) in vec4 inTangent;
layout(location = 3) in vec2 inUv0;
layout(location = 4) in vec2 inUv1;
layout(location = 5) in vec3 inColor;
layout(location = 6) in vec4 inBake;

#if VIEWS
// One of many views, by the command's base instance
layout(location = 7) in mat4 inClipFromWorld;
layout(location = 11) in vec4 inEye;       // xyz; w spread of one sample's ray cone in radians
layout(location = 12) in uint inViewport;
layout(location = 13) in vec4 inClip;      // in front of it; only where clipping is enabled
#endif

#define VERTEX_STAGE
#include "varyings.glsl"

void main() {
#if VIEWS
  gl_Position = inClipFromWorld * vec4(inPosition, 1.0);
  gl_ViewportIndex = int(inViewport);
  gl_ClipDistance[0] = dot(inClip, vec4(inPosition, 1.0));
#else
  gl_Position = frame.clipFromWorld * vec4(inPosition, 1.0);
#endif
#if VIEWS && FROM_EYE
  vertexFromEye = inPosition - inEye.xyz;
  viewEye = inEye;
#endif
#if !UNLIT || GBUFFER
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
