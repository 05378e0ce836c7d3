// The missing file is asked for on line 2.
#include "corner.glsl"
void main() {}
