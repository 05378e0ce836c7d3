// The rays of a lobe, as trace::lobeDirection() has them, of RAYS for each sample.
#include "methods/shared/shaders/lobe_rays.glsl"
#include "raster/shaders/shading.glsl"
#include "walk.glsl"

// What the image shows where a ray of a lobe would be, were it as long as the one in its centre
// [Wang2014, section 4.2.2].
Hit lookUp(DepthImage image, Start start, vec3 direction, Hit centre, float limit) {
  float t = min(centre.metres, limit);
  vec3 end = start.place + t * vec3(dot(image.rowX.xyz, direction), dot(image.rowY.xyz, direction),
                                    dot(image.rowW.xyz, direction));
  vec2 at = end.xy / max(end.z, 1e-30);
  bool inside = end.z > 0.0 && all(greaterThanEqual(at, vec2(0.0))) &&
                all(lessThan(at, image.place.zw));
  vec2 texel = clamp(at, vec2(0.0), image.place.zw - 1.0);
  float height = heightAt(image, texel);
  int layer = 0;
#if LAYERS == 2
  // Of both layers what lies about where the ray ends
  float second = secondAt(image, texel);
  float ends = image.horizon.w / end.z;
  bool nearer = second > 0.0 && abs(second - ends) < abs(height - ends);
  height = nearer ? second : height;
  layer = nearer ? secondLayer : 0;
#endif
  int kind = centre.kind == kMissed || !inside ? kMissed : height > 0.0 ? kHit : kSky;
  return Hit(kind, at, height, kind == kHit && centre.bridged, t, kind == kHit ? layer : 0);
}
