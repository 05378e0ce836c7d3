// Diffuse radiance in one of many views.
//   PEEL  1: of what lies behind the nearest surface
#include "raster/shaders/surface.glsl"
#include "views.glsl"

#if PEEL
uniform int frontLayer;
layout(binding = kFrontDepthUnit) uniform sampler2DArray frontDepth;
// Nearer to the first layer, in depth, hence in parallax, nothing is drawn. Ours.
const float kPeelDepth = 1e-3;
#endif

layout(location = 0) out vec4 outDiffuse;

void main() {
#if PEEL
  if (gl_FragCoord.z > texelFetch(frontDepth, ivec3(gl_FragCoord.xy, frontLayer), 0).r - kPeelDepth) {
    discard;
  }
#endif
  cutOut();
#if !FROM_EYE
  Surface surface = surfaceAt(vec4(0.0), vec3(0.0), 0.0, gl_FrontFacing);
#else
#if COMPOUND
  vec4 eye = vertexEye;
#else
  vec4 eye = view.eye;
#endif
  Surface surface = surfaceAt(eye, vertexFromEye, max(dot(vertexFromEye, vertexFromEye), 1e-20),
                              gl_FrontFacing);
#endif
  outDiffuse = vec4(surface.radiance, 1.0);
}
