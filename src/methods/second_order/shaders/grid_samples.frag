// Depth of a mirrored grid before anything is drawn to it: left as it is where a texel is a sample
// of its cluster; elsewhere the depth range's, so near that nothing is drawn.
uniform ivec2 sampleOfTexel;  // (x, y) is the texel of sample (sampleOfTexel.x - x, y - sampleOfTexel.y)
uniform uint known;           // the cluster's number in clusterSamples

layout(binding = 0, r16ui) readonly uniform uimage2D clusterSamples;

void main() {
  ivec2 texel = ivec2(gl_FragCoord.xy);
  ivec2 at = ivec2(sampleOfTexel.x - texel.x, texel.y - sampleOfTexel.y);
  if (imageLoad(clusterSamples, at).r == known) discard;
}
