// Which cube maps a sample reads, and how much of each.
//   PROBES  number of maps
//   BLEND   0: the map of the sample's group of reflectors; 1: the two nearest, by distance
//   PROXY   0: what a map shows is infinitely far; 1: on a box; 2: on a sphere about its centre
#if BLEND || PROXY
uniform vec3 centres[PROBES];  // of the maps, from the eye
uniform float nearMetres;
layout(binding = 2) uniform sampler2D depthSamples;  // reversed-Z

// The sample's place, from the eye. along: its ray, 1 m along the axis.
vec3 placeOf(vec3 along) {
  return along * (nearMetres / max(texelFetch(depthSamples, ivec2(gl_FragCoord.xy), 0).r, 1e-30));
}
#endif

#if PROBES > 1
#if BLEND
// Metres to the three nearest centres, ascending; 1e30 where there is none. maps: the first two.
vec3 nearestCentres(vec3 place, out ivec2 maps) {
  vec3 metres = vec3(1e30);
  maps = ivec2(0);
  for (int i = 0; i < PROBES; ++i) {
    float d = max(distance(place, centres[i]), 1e-30);
    if (d < metres.x) {
      metres = vec3(d, metres.xy);
      maps = ivec2(i, maps.x);
    } else if (d < metres.y) {
      metres.yz = vec2(d, metres.y);
      maps.y = i;
    } else {
      metres.z = min(metres.z, d);
    }
  }
  return metres;
}

// The share of the second nearest map; the nearest has the rest. By inverse distances, less that of
// the third, so that maps come and go with no share.
float shareOfSecond(vec3 metres) {
  vec2 weights = 1.0 / metres.xy - 1.0 / metres.z;
  return weights.y / max(weights.x + weights.y, 1e-37);
}
#else
layout(binding = 1) uniform usampler2D objectSamples;
layout(binding = 3) uniform usamplerBuffer groups;  // by object id

int mapOfObject() {
  return int(texelFetch(groups, int(texelFetch(objectSamples, ivec2(gl_FragCoord.xy), 0).r)).r);
}
#endif
#endif
