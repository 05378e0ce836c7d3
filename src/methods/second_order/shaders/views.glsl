// Many views that are drawn together.
//   COMPOUND  1: many of them in one draw
#include "views_constants.glsl"

#if COMPOUND
struct ViewOfMany {
#else
layout(std140, binding = kViewBlock) uniform View {
#endif
  mat4 clipFromWorld;
  vec4 eye;      // xyz; w spread of one sample's ray cone in radians
  vec4 ownClip;  // of the object behind which the eye is: drawn in front of it
#if COMPOUND
  vec4 place;    // of its rectangle in the layer's clip space: scale, centre
};
layout(std140, binding = kViewBlock) uniform Views { ViewOfMany views[kCompoundViews]; };
#else
} view;
#endif
#if FROM_EYE
VARYING vec3 vertexFromEye;
#if COMPOUND
flat VARYING vec4 vertexEye;
#endif
#endif
