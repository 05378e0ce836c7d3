// Vertices of objects where a reflector shows them.
#include "raster/shaders/vertex.glsl"
#include "virtual.glsl"
#include "virtual_constants.glsl"

layout(location = kImageAttribute) in vec4 inImage;  // where it appears; |x - eye| / |image - eye|
#if PLACES
layout(location = kPlaceAttribute) in vec3 inPlace;  // where the last reflector shows it
#endif

void main() {
  gl_Position = frame.clipFromWorld * vec4(inImage.xyz, 1.0);
  vertexPosition = inPosition;
  vertexShare = inImage.w;
#if PLACES
  vertexPlace = inPlace;
#endif
  passAttributes();
}
