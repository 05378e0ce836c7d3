// A ray against the quad of an impostor: u and v where it meets the plane, and the distance.
bool meetsQuad(int texel, vec3 origin, vec3 direction, out float t, out vec2 uv) {
  vec4 plane = texelFetch(impostorTable, texel + kPlane);
  t = -(dot(plane.xyz, origin) + plane.w) / dot(plane.xyz, direction);
  vec4 place = vec4(origin + t * direction, 1.0);
  uv = vec2(dot(texelFetch(impostorTable, texel + kRowU), place),
            dot(texelFetch(impostorTable, texel + kRowV), place));
#if GLOSSY
  const float margin = 0.5;  // look-ups wider than that see the environment there
#else
  const float margin = 0.0;
#endif
  return t > 0.0 && t < 1e30 && all(greaterThanEqual(uv, vec2(-margin))) &&
         all(lessThanEqual(uv, vec2(1.0 + margin)));
}
