// What rays see that find nothing in their depth image: the cube map, or the sky.
#include "constants.glsl"
#include "methods/shared/shaders/box_exit.glsl"
#include "raster/shaders/lobe.glsl"
#include "raster/shaders/shading.glsl"

layout(binding = kCubeMapBinding) uniform samplerCube environmentMap;

uniform vec3 sceneLeast;  // corners of the scene's box, from the eye
uniform vec3 sceneMost;
uniform vec3 cubeCentre;  // of the cube map, from the eye
uniform float lastLevel;
uniform float levelOffset;  // 0.5 log2(4 / solid angle of a texel of level 0, sr)

// Level of the cube map for one of `rays` rays of a lobe.
float lobeLevel(float exponent, float rays) {
  float level = levelOffset - 0.5 * log2(exponent + 1.0);
  level -= 0.5 * log2(rays);
  return clamp(level, 0.0, lastLevel);
}

// Whether the cube map shows nothing but surfaces far around (4 x 4 texels of a face), as in a closed
// room, which the eye is in: from within a vase it shows no more.
bool closedAround(vec3 direction) {
  bool within = all(lessThan(sceneLeast, vec3(0.0))) && all(greaterThan(sceneMost, vec3(0.0)));
  return within &&
         textureLod(environmentMap, direction, max(lastLevel - 2.0, 0.0)).a > 0.999;
}
// What the cube map shows along a ray from p: the place where it leaves the scene's box, in closed
// rooms [Lagarde2012].
vec3 fallback(vec3 p, vec3 direction, float level) {
  float t = boxExit(sceneLeast, sceneMost, p, direction);
  vec3 seen = t > 0.0 && t < 1e30 ? p + t * direction - cubeCentre : direction;
  return textureLod(environmentMap, closedAround(seen) ? seen : direction, level).rgb;
}
// What a ray over nothing leads to: beyond the scene, or in a closed room through a gap.
vec3 overNothing(vec3 p, vec3 direction, float level) {
  return closedAround(direction) ? fallback(p, direction, level) : environmentRadiance(direction);
}
