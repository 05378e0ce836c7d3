#include "methods/shared/cube_map.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace catoptric::methods {

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
