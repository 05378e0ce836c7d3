// The nearest surfaces behind those that the frame shows [Mara2016].
#include "raster/shaders/lobe.glsl"
#include "raster/shaders/surface.glsl"

layout(binding = kFirstPassUnit) uniform sampler2D firstDepths;
layout(std140, binding = 2) uniform Distances {
  vec4 metres;  // of the near plane; least separation of the layers
} distances;
uniform uint objectId;

layout(location = 0) out vec4 outColour;    // diffuse radiance, s
layout(location = 1) out uvec2 outSurface;  // object id, packed normal

void main() {
  float first = texelFetch(firstDepths, ivec2(gl_FragCoord.xy), 0).r;
  // Reversed depth is near / distance
  if (gl_FragCoord.z * (distances.metres.x + distances.metres.y * first) >= distances.metres.x * first)
    discard;
  cutOut();
  Surface surface = surfaceSeen();
  outColour = vec4(surface.radiance, surface.s);
  outSurface = uvec2(objectId, packedLobeHorizon(surface.normal));
}
