// What a pass says of a sample besides its radiance, in values and bits that later passes and the
// CPU (ray_pass.cpp) read.
#include "constants.glsl"
#include "raster/shaders/masks.glsl"

// a of a sample that is still to be looked up, by look_up.frag: in the cube map; over nothing, in a
// depth image that may have gaps; or beyond the scene
const float kInCubeMap = -1.0;
const float kOverNothing = -0.5;
const float kBeyondScene = 0.0;

// The marks of a sample whose reflection has been written.
uint marksOf(vec4 reflection, uint bits) {
  return reflection.a <= 0.0 ? bits | kMarkLater : bits;
}
