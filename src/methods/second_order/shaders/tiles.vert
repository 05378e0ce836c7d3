// Squares of samples, as points: the tiles to look up.
#include "constants.glsl"

layout(binding = kTilesBinding) uniform usamplerBuffer tiles;

uniform int tilesAcross;
uniform int tilesDown;

void main() {
  int tile = int(texelFetch(tiles, gl_VertexID).r);
  vec2 centre = vec2(tile % tilesAcross, tile / tilesAcross) + 0.5;
  vec2 place = centre / vec2(tilesAcross, tilesDown);
  gl_Position = vec4(2.0 * place.x - 1.0, 1.0 - 2.0 * place.y, 0.0, 1.0);
}
