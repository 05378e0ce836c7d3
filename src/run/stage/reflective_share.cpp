#include "run/stage/reflective_share.h"

#include <algorithm>
#include <vector>

#include "frame/geometry.h"
#include "scene/animate.h"
#include "scene/camera.h"
#include "trace/embree/trace_scene.h"

namespace catoptric::run {

double reflectiveShare(const scene::Scene& scene) {
  if (scene.reflectorCount() == 0) return 0.0;
  constexpr int kRays = 128;  ///< per axis; ours
  const scene::PathFrame first = scene::cameraPath("", scene)->frame(1);
  const frame::Geometry geometry =
      frame::makeGeometry(scene, scene::poseAt(scene, first.timeSeconds));
  const trace::TraceScene trace(scene, geometry, trace::BvhPolicy::Static);
  std::vector<trace::Ray> rays;
  for (int y = 0; y < kRays; ++y)
    for (int x = 0; x < kRays; ++x) {
      trace::Ray ray;
      ray.origin = first.camera.eye();
      ray.direction = scene::rayDirection(first.camera, kRays, kRays, static_cast<float>(x) + 0.5f,
                                          static_cast<float>(y) + 0.5f);
      ray.near = first.camera.nearMetres / glm::dot(ray.direction, first.camera.forward());
      rays.push_back(ray);
    }
  std::vector<trace::Hit> hits(rays.size());
  trace.intersectSerial(rays, hits, true);
  const auto reflective = std::ranges::count_if(hits, [&](const trace::Hit& hit) {
    return !hit.miss() && scene.objects[hit.object].reflector > 0;
  });
  return static_cast<double>(reflective) / static_cast<double>(hits.size());
}

}  // namespace catoptric::run
