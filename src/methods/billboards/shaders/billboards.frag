// Reflections from billboards [Popescu2006, Sec. 3.1].
#include "methods/shared/impostors/shaders/impostors.glsl"
#include "methods/shared/impostors/shaders/quad.glsl"

bool meets(int texel, int way, float steepest, vec3 origin, vec3 direction, out float t,
           out vec2 uv, out float share, inout uint work) {
  ++work;
#if WALLS
  if (way == kWayBox || way == kWayShared) return meetsBox(texel, origin, direction, t, uv, share);
#endif
  share = 0.0;
  return meetsQuad(texel, origin, direction, t, uv);
}
