// Squares of TILE x TILE samples: those that intersect.frag has listed.
layout(binding = 9) uniform usamplerBuffer tiles;

uniform vec2 samples;  // of the frame
uniform uint tilesAcross;
uniform uint tileCount;

void main() {
  uint tile = texelFetch(tiles, int(4u + tileCount) + gl_InstanceID).r;
  uvec2 corner = uvec2(tile % tilesAcross, tile / tilesAcross);
  vec2 at = vec2((corner + uvec2(gl_VertexID & 1, gl_VertexID >> 1)) * uint(TILE));
  at = min(at, samples);
  gl_Position = vec4(2.0 * at.x / samples.x - 1.0, 1.0 - 2.0 * at.y / samples.y, 0.0, 1.0);
}
