#include "run/stage/motion_layer.h"

#include <cmath>

#include "scene/animate.h"

namespace catoptric::run {
namespace {

using DMat3 = glm::dmat3;
using DMat4 = glm::dmat4;
using DVec3 = glm::dvec3;
using DVec4 = glm::dvec4;

/// Maps world points at the frame's time to those at the earlier time.
struct RigidMotion {
  bool known = false;
  DMat4 earlierFromNow{1.0};
};

std::vector<RigidMotion> motionsOf(const frame::Geometry& geometry, const EarlierView& earlier) {
  std::vector<RigidMotion> motions(geometry.objects.size());
  for (std::size_t i = 0; i < motions.size(); ++i) {
    const frame::ObjectRange& object = geometry.objects[i];
    if (object.deforms) continue;
    if (object.worldFromObject == earlier.worldFromObject[i]) {  // nothing is rounded
      motions[i].known = true;
      continue;
    }
    const DMat4 now(object.worldFromObject);
    if (!(std::abs(glm::determinant(now)) > 0.0)) continue;
    motions[i] = {true, DMat4(earlier.worldFromObject[i]) * glm::inverse(now)};
  }
  return motions;
}

}  // namespace

EarlierView earlierView(const scene::Scene& scene, const scene::PathFrame& frame) {
  EarlierView earlier{frame.camera, {}};
  const scene::Pose pose = scene::poseAt(scene, frame.timeSeconds);
  for (const scene::Object& object : scene.objects)
    earlier.worldFromObject.push_back(scene::worldFromObject(scene, object, pose));
  return earlier;
}

std::vector<Vec3> motionLayer(const SamplePlaces& places, const scene::Camera& camera,
                              const frame::Geometry& geometry, const EarlierView& earlier) {
  std::vector<Vec3> layer(
      static_cast<std::size_t>(places.width) * static_cast<std::size_t>(places.height), Vec3(0.0f));
  const std::vector<RigidMotion> motions = motionsOf(geometry, earlier);
  const DMat3 rays(scene::rayFromPixel(camera, places.width, places.height));
  const DMat3 pixels =
      glm::inverse(DMat3(scene::rayFromPixel(earlier.camera, places.width, places.height)));
  const int middle = places.samples / 2;
  for (int y = 0; y < places.height; ++y)
    for (int x = 0; x < places.width; ++x) {
      const std::size_t s = static_cast<std::size_t>(y * places.samples + middle) *
                                static_cast<std::size_t>(places.width * places.samples) +
                            static_cast<std::size_t>(x * places.samples + middle);
      const std::uint32_t id = places.object[s];
      if (id == 0 || !(places.depth[s] > 0.0f)) continue;
      const RigidMotion& motion = motions[id - 1];
      if (!motion.known) continue;
      const double offset = (middle + 0.5) / places.samples;
      const DVec3 place(x + offset, y + offset, 1.0);
      const DVec3 point = DVec3(camera.eye()) +
                          rays * place * (double{camera.nearMetres} / double{places.depth[s]});
      const DVec3 before =
          pixels * (DVec3(motion.earlierFromNow * DVec4(point, 1.0)) - DVec3(earlier.camera.eye()));
      if (!(before.z > 0.0)) continue;
      layer[static_cast<std::size_t>(y) * static_cast<std::size_t>(places.width) +
            static_cast<std::size_t>(x)] =
          Vec3(place.x - before.x / before.z, place.y - before.y / before.z, before.z);
    }
  return layer;
}

}  // namespace catoptric::run
