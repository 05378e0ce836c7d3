// Where a ray from p along d leaves the box from `least` to `most`, in lengths of d.
float boxExit(vec3 least, vec3 most, vec3 p, vec3 d) {
  vec3 exits = max((least - p) / d, (most - p) / d);
  return min(exits.x, min(exits.y, exits.z));
}
