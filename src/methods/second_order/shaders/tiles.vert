// Squares of TILE x TILE samples, as points: those that intersect.frag has listed.
layout(binding = 9) uniform usamplerBuffer tiles;

uniform uint tilesAcross;
uniform uint tileCount;

void main() {
  uint tile = texelFetch(tiles, int(4u + tileCount) + gl_VertexID).r;
  vec2 centre = vec2(tile % tilesAcross, tile / tilesAcross) + 0.5;
  vec2 place = centre / vec2(tilesAcross, tileCount / tilesAcross);
  gl_Position = vec4(2.0 * place.x - 1.0, 1.0 - 2.0 * place.y, 0.0, 1.0);
}
