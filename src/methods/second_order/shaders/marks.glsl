// What a pass says of a sample besides its radiance, in values and bits that later passes and the
// CPU (ray_pass.cpp) read.

// a of a sample that is still to be looked up, by look_up.frag: in the cube map; over nothing, in a
// depth image that may have gaps; or beyond the scene
const float kInCubeMap = -1.0;
const float kOverNothing = -0.5;
const float kBeyondScene = 0.0;

const uint kMaskEnvironment = 1u;  // raster::MaskBit
const uint kMaskBelowHorizon = 16u;
const uint kMaskSky = 32u;
// Marks of this method beside those bits, counted on the CPU: of atomics llvmpipe loops over all
// lanes, of those that nobody takes, too. A ray of the sample ends over a depth edge; the sample is
// left to look_up.frag.
const uint kMarkBridged = 16384u;
const uint kMarkLater = 32768u;

// The marks of a sample whose reflection has been written.
uint marksOf(vec4 reflection, uint bits) {
  return reflection.a <= 0.0 ? bits | kMarkLater : bits;
}
