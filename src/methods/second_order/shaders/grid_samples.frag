// Depth of a mirrored grid before anything is drawn to it: 1, so near that nothing is drawn, where a
// texel is no sample of its cluster, else 0.
uniform ivec2 sampleOfTexel;  // (x, y) is the texel of sample (sampleOfTexel.x - x, y - sampleOfTexel.y)
uniform uint known;           // the cluster's number in clusterSamples

layout(binding = 0) uniform usampler2D clusterSamples;

void main() {
  ivec2 texel = ivec2(gl_FragCoord.xy);
  ivec2 at = ivec2(sampleOfTexel.x - texel.x, texel.y - sampleOfTexel.y);
  gl_FragDepth = texelFetch(clusterSamples, at, 0).r == known ? 0.0 : 1.0;
}
