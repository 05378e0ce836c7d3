// A ray against the quad of an impostor: u and v where it meets the plane, and the distance.
bool meetsQuad(int texel, vec3 origin, vec3 direction, out float t, out vec2 uv) {
  vec4 plane = texelFetch(impostorTable, texel + kPlane);
  t = -(dot(plane.xyz, origin) + plane.w) / dot(plane.xyz, direction);
  vec4 place = vec4(origin + t * direction, 1.0);
  uv = vec2(dot(texelFetch(impostorTable, texel + kRowU), place),
            dot(texelFetch(impostorTable, texel + kRowV), place));
#if GLOSSY
  return t > 0.0 && t < 1e30;  // a wide look-up beside the quad may reach onto it
#else
  return t > 0.0 && t < 1e30 && all(greaterThanEqual(uv, vec2(0.0))) &&
         all(lessThanEqual(uv, vec2(1.0)));
#endif
}

// A ray against the quad and the walls of height `height` that stand on its edges, as one box: the
// face without the lid through which it leaves. `share` is 0 on the quad and rises to 1 on top of
// the walls; uv is the place on the quad below.
bool meetsBox(int texel, vec3 origin, vec3 direction, out float t, out vec2 uv, out float share) {
  vec4 plane = texelFetch(impostorTable, texel + kPlane);
  vec4 walls = texelFetch(impostorTable, texel + kWalls);
  vec4 rowU = texelFetch(impostorTable, texel + kRowU);
  vec4 rowV = texelFetch(impostorTable, texel + kRowV);
  vec4 o = vec4(origin, 1.0);
  vec4 up = plane * (walls.b / walls.r);  // 0 on the quad, 1 on top
  vec3 start = vec3(dot(rowU, o), dot(rowV, o), dot(up, o));
  vec3 step = vec3(dot(rowU.xyz, direction), dot(rowV.xyz, direction), dot(up.xyz, direction));
  vec3 low = -start / step;
  vec3 high = (1.0 - start) / step;
  vec3 enters = min(low, high);
  vec3 leaves = max(low, high);
  float from = max(max(enters.x, enters.y), enters.z);
  t = min(min(leaves.x, leaves.y), leaves.z);
  vec3 place = start + t * step;
  uv = clamp(place.xy, vec2(0.0), vec2(1.0));
  bool lid = leaves.z <= t && step.z > 0.0;
  share = leaves.z <= t ? 0.0 : clamp(place.z, 0.0, 1.0);
  return from <= t && t > 0.0 && t < 1e30 && !lid;
}
