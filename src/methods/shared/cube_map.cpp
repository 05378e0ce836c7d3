#include "methods/shared/cube_map.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace catoptric::methods {

namespace {

/// A reflector about a map's centre has at most this share of the scene's diameter: a room's shell
/// is what the map is for. Ours.
constexpr float kLargestAbout = 0.5f;

/// Ids of reflectors whose box holds `centre`: from in there the map would show nothing but them.
std::vector<int> reflectorsAbout(const Vec3& centre, const scene::Scene& scene,
                                 const frame::Geometry& geometry) {
  std::vector<int> ids;
  for (std::size_t i = 0; i < geometry.objects.size(); ++i) {
    const Box3& box = geometry.objects[i].bounds;
    const Vec3 size = box.max - box.min;
    const bool flat = std::min({size.x, size.y, size.z}) <= 1e-3f * glm::length(size);
    if (scene.objects[i].reflector != 0 && !flat &&
        glm::length(size) <= kLargestAbout * geometry.bounds.diameter() &&
        glm::all(glm::lessThanEqual(box.min, centre)) &&
        glm::all(glm::greaterThanEqual(box.max, centre))) {
      ids.push_back(static_cast<int>(i) + 1);
    }
  }
  return ids;
}

}  // namespace

std::uint64_t cubeMapBytes(int faceSize, std::uint64_t bytesPerTexel) {
  std::uint64_t texels = 0;
  for (std::uint64_t size = static_cast<std::uint64_t>(faceSize); size > 0; size /= 2) {
    texels += 6 * size * size;
  }
  return texels * bytesPerTexel;
}

void CubeMap::draw(Services& services, const Vec3& centre, int faceSize,
                   const raster::ObjectSet& objects) {
  services.timer.measure("cube_map", [&] {
    take(services.raster->drawCubeMap(centre, faceSize, services.lighting, objects,
                                      std::move(texture_)));
    clampedTexels_ = raster::clampedTexels(texture_);
    lights_ = services.lighting.lights;
  });
}

void CubeMap::draw(Services& services, const Vec3& centre, int faceSize) {
  draw(services, centre, faceSize,
       raster::ObjectSet::without(reflectorsAbout(centre, services.scene, services.geometry)));
}

void CubeMap::follow(const FrameInput& input, Services& services, const Vec3& centre,
                     int faceSize) {
  const bool moved =
      services.scene.animated() && (input.firstOfSequence || !input.changedObjects.empty() ||
                                    lights_ != services.lighting.lights);
  if (empty() || moved) draw(services, centre, faceSize);
}

void CubeMap::take(gl::Texture texture) {
  texture_ = std::move(texture);
  texture_.setFilter(GL_LINEAR_MIPMAP_LINEAR, GL_LINEAR);
}

void CubeMap::setLevels(gl::Program& program) const {
  // Texels of level 0 have 4 pi / (6 size^2) sr on average.
  const auto size = static_cast<float>(texture_.width());
  program.set("levelOffset", 0.5f * std::log2(6.0f / kPi * size * size));
  program.set("lastLevel", static_cast<float>(texture_.levels() - 1));
}

}  // namespace catoptric::methods
