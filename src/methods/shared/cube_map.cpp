#include "methods/shared/cube_map.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

namespace catoptric::methods {

namespace {

/// An object about a map's centre that has more than this share of the scene's diameter is a room's
/// shell, which the map is for, unless it is a solid that reflects: a model alone. Ours.
constexpr float kLargestAbout = 0.5f;
/// A surface encloses a point if it winds around it by more than this. It is 1 inside of a closed
/// surface with outward normals, 0 outside [Jacobson2013].
constexpr double kEncloses = 0.5;

/// How often an object's surface winds around a point: the sum of its triangles' signed solid
/// angles [Jacobson2013], as a share of all directions.
double winding(const Vec3& point, const frame::Geometry& geometry,
               const frame::ObjectRange& object) {
  double sum = 0.0;
  for (std::uint32_t i = object.firstIndex; i < object.firstIndex + object.indexCount; i += 3) {
    const auto corner = [&](std::uint32_t k) {
      return glm::dvec3(geometry.positions[geometry.indices[i + k]] - point);
    };
    const glm::dvec3 a = corner(0);
    const glm::dvec3 b = corner(1);
    const glm::dvec3 c = corner(2);
    const double la = glm::length(a);
    const double lb = glm::length(b);
    const double lc = glm::length(c);
    sum += std::atan2(glm::dot(a, glm::cross(b, c)), la * lb * lc + glm::dot(a, b) * lc +
                                                         glm::dot(b, c) * la + glm::dot(c, a) * lb);
  }
  return sum / (2.0 * static_cast<double>(kPi));
}

}  // namespace

std::uint64_t cubeMapBytes(int faceSize, std::uint64_t bytesPerTexel) {
  std::uint64_t texels = 0;
  for (std::uint64_t size = static_cast<std::uint64_t>(faceSize); size > 0; size /= 2) {
    texels += 6 * size * size;
  }
  return texels * bytesPerTexel;
}

std::vector<PlanItem> cubeMapItems(int faceSize, bool again, int maps) {
  const std::string size = std::to_string(faceSize);
  const std::string count = std::to_string(maps);
  const std::string drawn = again ? ", drawn again in frames in which an object or a light moved"
                                  : ", drawn once: it does not change";
  return {{again ? "pass" : "precomputation", "cube_map",
           maps == 1 ? "the diffuse scene from one point" + drawn
                     : "the diffuse scene from up to " + count +
                           " points: those that a frame reads" + drawn},
          {"resource", "cube map",
           (maps == 1 ? "" : "up to " + count + " of ") + "6 faces of " + size + " x " + size +
               ", RGBA16F, with mip levels",
           static_cast<std::uint64_t>(maps) * cubeMapBytes(faceSize, 8)}};
}

std::vector<int> enclosing(const Vec3& centre, const scene::Scene& scene,
                           const frame::Geometry& geometry) {
  std::vector<int> ids;
  for (std::size_t i = 0; i < geometry.objects.size(); ++i) {
    const frame::ObjectRange& object = geometry.objects[i];
    const Box3& box = object.bounds;
    if (!glm::all(glm::lessThanEqual(box.min, centre)) ||
        !glm::all(glm::greaterThanEqual(box.max, centre)))
      continue;
    const Vec3 size = box.max - box.min;
    const bool large = glm::length(size) > kLargestAbout * geometry.bounds.diameter();
    const bool reflects = scene.objects[i].reflector != 0;
    if (large && !reflects) continue;
    const bool flat = std::min({size.x, size.y, size.z}) <= 1e-3f * glm::length(size);
    if (reflects && !large ? !flat : winding(centre, geometry, object) > kEncloses)
      ids.push_back(static_cast<int>(i) + 1);
  }
  return ids;
}

void CubeMap::drawUntimed(Services& services, const Vec3& centre, int faceSize,
                          const raster::ObjectSet& objects) {
  take(services.raster->drawCubeMap(centre, faceSize, services.lighting, objects,
                                    std::move(texture_)));
  clampedTexels_ = raster::clampedTexels(texture_);
  lights_ = services.lighting.lights;
  outdated_ = false;
}

void CubeMap::draw(Services& services, const Vec3& centre, int faceSize,
                   const raster::ObjectSet& objects) {
  services.timer.measure("cube_map", [&] { drawUntimed(services, centre, faceSize, objects); });
}

void CubeMap::draw(Services& services, const Vec3& centre, int faceSize) {
  services.timer.measure("cube_map", [&] {
    drawUntimed(services, centre, faceSize,
                raster::ObjectSet::without(enclosing(centre, services.scene, services.geometry)));
  });
}

void CubeMap::follow(const FrameInput& input, Services& services, const Vec3& centre, int faceSize,
                     bool read) {
  const bool animated = services.scene.animated();
  outdated_ = outdated_ || (animated && (input.firstOfSequence || !input.changedObjects.empty()));
  if (!read) return;
  const bool relit = animated && lights_ != services.lighting.lights;
  if (empty() || outdated_ || relit) draw(services, centre, faceSize);
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
