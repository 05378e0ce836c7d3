// Vertices of the scene in one of many views.
#include "raster/shaders/vertex.glsl"
#include "views.glsl"

#if COMPOUND
layout(location = kViewAttribute) in float inView;  // by the command's first instance
#endif

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
#if FROM_EYE
  vertexEye = view.eye;
#endif
#else
  gl_Position = view.clipFromWorld * vec4(inPosition, 1.0);
#endif
  gl_ClipDistance[0] = dot(view.ownClip, vec4(inPosition, 1.0));
#if FROM_EYE
  vertexFromEye = inPosition - view.eye.xyz;
#endif
  passAttributes();
}
