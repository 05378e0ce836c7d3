// Reflections from billboards [Popescu2006, Sec. 3.1].
#include "methods/impostors/shaders/impostors.glsl"
#include "methods/impostors/shaders/quad.glsl"

bool meets(int texel, int way, vec3 origin, vec3 direction, out float t, out vec2 uv,
           inout uint work, inout uint marks) {
  work += 1u;
  return meetsQuad(texel, origin, direction, t, uv);
}
