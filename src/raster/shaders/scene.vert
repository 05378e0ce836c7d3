// Vertices of the scene, already in world space.
#include "shading.glsl"

layout(location = 0) in vec3 inPosition;
layout(location = 1) in vec3 inNormal;
layout(location = 2) in vec4 inTangent;
layout(location = 3) in vec2 inUv0;
layout(location = 4) in vec2 inUv1;
layout(location = 5) in vec3 inColor;
layout(location = 6) in vec4 inBake;
#if VIRTUAL
layout(location = 7) in vec4 inImage;  // where it appears; |x - eye| / |image - eye|
#if PLACES
layout(location = 8) in vec3 inPlace;  // where the last reflector shows it
#endif
#endif

#if COMPOUND
layout(location = 7) in float inView;  // by the command's first instance
#endif

#define VERTEX_STAGE
#include "varyings.glsl"

void main() {
#if COMPOUND
  ViewOfMany view = views[int(inView)];
  vec4 place = view.clipFromWorld * vec4(inPosition, 1.0);
  gl_Position = vec4(view.place.xy * place.xy + view.place.zw * place.w, place.zw);
  // The view's rectangle
  gl_ClipDistance[1] = place.w + place.x;
  gl_ClipDistance[2] = place.w - place.x;
  gl_ClipDistance[3] = place.w + place.y;
  gl_ClipDistance[4] = place.w - place.y;
  gl_ClipDistance[0] = dot(view.ownClip, vec4(inPosition, 1.0));
#if FROM_EYE
  vertexEye = view.eye;
#endif
#elif VIEWS
  gl_Position = view.clipFromWorld * vec4(inPosition, 1.0);
  gl_ClipDistance[0] = dot(view.ownClip, vec4(inPosition, 1.0));
#elif VIRTUAL
  gl_Position = frame.clipFromWorld * vec4(inImage.xyz, 1.0);
  vertexPosition = inPosition;
  vertexShare = inImage.w;
#if PLACES
  vertexPlace = inPlace;
#endif
#else
  gl_Position = frame.clipFromWorld * vec4(inPosition, 1.0);
#endif
#if VIEWS && FROM_EYE
  vertexFromEye = inPosition - view.eye.xyz;
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
