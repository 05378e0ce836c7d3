#include "methods/glossy_lod/sizes.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include "scene/animate.h"
#include "scene/camera.h"

namespace catoptric::methods::glossy_lod {
namespace {

/// Quads of an object for each triangle, and for each pixel that it can cover; but no more than so
/// many for a triangle, which is flat. Ours: L1_8bit of the bathroom is 0.07 with both, 0.12 with
/// triangles alone.
constexpr double kQuadsPerTriangle = 2.0;
constexpr double kQuadsPerPixel = 1.0 / 16.0;
constexpr double kMostPerTriangle = 64.0;
/// Texels of a textured object for each such pixel. Ours: over a mirror floor before bricks L1_8bit
/// is 1.0 with 1 and 0.3 with 2.
constexpr double kTexelsPerPixel = 2.0;
/// Quads and texels of an object at the least: light varies without textures, too. Ours.
constexpr double kLeast = 64.0 * 64.0;
/// All quads of images whose size is given. Ours: 0.8 GB.
constexpr double kMostQuads = 6e6;
/// Places of an object, and frames of the path, that are looked at. Ours.
constexpr std::size_t kPlaces = 64;
constexpr int kFrames = 32;
/// Metres that no place counts as nearer to the camera. Ours.
constexpr float kNearest = 0.25f;
/// Part of the memory that quads may take. Ours: too few change shapes, too few texels only blur.
constexpr double kQuadsShare = 0.5;
/// Bytes of a quad (vertex, nodes, sample) and of a texel (place, radiance of a side, and what the
/// atlas leaves free).
constexpr double kQuadBytes = 16.0 + 48.0 * 4.0 / 3.0 + 24.0;
constexpr double kTexelBytes = 12.0 + 16.0 * 1.5 * 1.5;

/// To the nearest of boxes.
float metresTo(const std::vector<Box3>& boxes, const Vec3& place) {
  float metres = std::numeric_limits<float>::infinity();
  for (const Box3& box : boxes)
    metres = std::min(metres, glm::distance(place, glm::clamp(place, box.min, box.max)));
  return metres;
}

/// An object's triangles in the world.
struct Placed {
  std::size_t triangles = 0;
  double area = 0.0;         ///< m^2
  std::vector<Vec3> places;  ///< of equal area
  Box3 box;
};

Placed placedAt(const scene::Scene& scene, const scene::Object& object, const scene::Pose& pose) {
  const scene::WorldVertices vertices = scene::worldVertices(scene, object, pose);
  const std::vector<std::uint32_t>& indices = scene.meshes[object.mesh].indices;
  const auto corner = [&](std::size_t c) { return vertices.positions[indices[c]]; };
  Placed placed;
  placed.triangles = indices.size() / 3;
  std::vector<double> upTo;
  for (std::size_t c = 0; c < indices.size(); c += 3) {
    placed.area += 0.5 * static_cast<double>(glm::length(
                             glm::cross(corner(c + 1) - corner(c), corner(c + 2) - corner(c))));
    upTo.push_back(placed.area);
    for (std::size_t i = 0; i < 3; ++i) placed.box.extend(corner(c + i));
  }
  for (std::size_t k = 0; k < kPlaces && placed.area > 0.0; ++k) {
    const double at = placed.area * (static_cast<double>(k) + 0.5) / kPlaces;
    const auto t =
        static_cast<std::size_t>(std::upper_bound(upTo.begin(), upTo.end(), at) - upTo.begin());
    const std::size_t c = 3 * std::min(t, placed.triangles - 1);
    // Spread over a triangle by the sequence R2, folded
    float u = std::fmod(0.5f + 0.7548777f * static_cast<float>(k), 1.0f);
    float v = std::fmod(0.5f + 0.5698403f * static_cast<float>(k), 1.0f);
    if (u + v > 1.0f) {
      u = 1.0f - u;
      v = 1.0f - v;
    }
    placed.places.push_back(corner(c) + u * (corner(c + 1) - corner(c)) +
                            v * (corner(c + 2) - corner(c)));
  }
  return placed;
}

/// Pixels that an object's surface covers where a camera's rays reach it by a reflector, at the
/// most, of the camera that sees most.
double pixelsOf(const Placed& placed, const std::vector<Box3>& reflectors,
                const std::vector<scene::Camera>& cameras, int height) {
  std::vector<float> toReflector;
  for (const Vec3& place : placed.places) toReflector.push_back(metresTo(reflectors, place));
  double most = 0.0;
  for (const scene::Camera& camera : cameras) {
    const Vec3 eye = camera.eye();
    const float eyeToReflector = metresTo(reflectors, eye);
    double sum = 0.0;
    for (std::size_t i = 0; i < placed.places.size(); ++i) {
      const double metres = static_cast<double>(std::max(
          {kNearest, glm::distance(eye, placed.places[i]), eyeToReflector + toReflector[i]}));
      sum += 1.0 / (metres * metres);
    }
    const auto spread = static_cast<double>(scene::pixelSpreadRad(camera, height));
    most = std::max(most, sum / (spread * spread));
  }
  return placed.area * most / kPlaces;
}

bool isTextured(const scene::Material& material) {
  return material.baseColorTexture.used() || material.emissiveTexture.used() ||
         material.normalTexture.used();
}

/// Cameras of some frames, from the first to the last.
std::vector<scene::Camera> camerasOf(const scene::CameraPath& path) {
  std::vector<scene::Camera> cameras;
  const int count = std::min(path.count(), kFrames);
  for (int k = 0; k < count; ++k)
    cameras.push_back(path.frame(1 + k * (path.count() - 1) / std::max(1, count - 1)).camera);
  return cameras;
}

/// As many as the objects ask for.
std::vector<ImageSize> wantedSizes(const scene::Scene& scene, const std::vector<bool>& shown,
                                   const RunSettings& settings) {
  const bool known = settings.path != nullptr;
  const scene::Pose pose = scene::poseAt(scene, known ? settings.path->frame(1).timeSeconds : 0.0);
  std::vector<Placed> placed;
  std::vector<Box3> reflectors;
  for (const scene::Object& object : scene.objects) {
    placed.push_back(placedAt(scene, object, pose));
    if (object.reflector != 0) reflectors.push_back(placed.back().box);
  }
  std::vector<scene::Camera> cameras;
  if (known) cameras = camerasOf(*settings.path);
  std::vector<ImageSize> wanted(scene.objects.size());
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    if (!shown[i]) continue;
    const double pixels =
        std::max(kLeast, pixelsOf(placed[i], reflectors, cameras, settings.height));
    const auto triangles = static_cast<double>(placed[i].triangles);
    wanted[i].quads = std::min(
        pixels, std::max({kLeast, kQuadsPerTriangle * triangles,
                          std::min(kQuadsPerPixel * pixels, kMostPerTriangle * triangles)}));
    wanted[i].texels =
        isTextured(scene.materials[scene.objects[i].material]) ? kTexelsPerPixel * pixels : kLeast;
  }
  // Objects with the same mesh share its image
  std::vector<ImageSize> ofMesh(scene.meshes.size());
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    ImageSize& size = ofMesh[static_cast<std::size_t>(scene.objects[i].mesh)];
    size = {std::max(size.quads, wanted[i].quads), std::max(size.texels, wanted[i].texels),
            1 << kMostLevels};
  }
  for (std::size_t i = 0; i < wanted.size(); ++i)
    if (shown[i]) wanted[i] = ofMesh[static_cast<std::size_t>(scene.objects[i].mesh)];
  return wanted;
}

}  // namespace

std::uint64_t imageBytes(double quads, double texels) {
  return static_cast<std::uint64_t>(kQuadBytes * quads + kTexelBytes * texels);
}

Sizes findSizes(const scene::Scene& scene, const RunSettings& settings, const Options& options) {
  std::vector<bool> shown;
  for (const scene::Object& object : scene.objects)
    shown.push_back(object.reflector == 0 || options.objects == Objects::All);
  const auto objects = static_cast<double>(std::ranges::count(shown, true));
  Sizes sizes;
  double quadsShare = 1.0;
  double texelsShare = 1.0;
  const auto add = [&](const std::vector<ImageSize>& all) {
    sizes.quads = sizes.texels = 0.0;
    for (const ImageSize& size : all) {
      sizes.quads += size.quads;
      sizes.texels += size.texels > 0.0 ? size.texels : size.quads;
    }
  };
  if (options.size > 0) {
    const double quads = static_cast<double>(options.size) * options.size;
    for (const bool any : shown) sizes.ofObject.push_back({any ? quads : 0.0, 0.0, options.size});
    quadsShare = std::min(1.0, kMostQuads / std::max(1.0, objects * quads));
  } else {
    sizes.ofObject = wantedSizes(scene, shown, settings);
    add(sizes.ofObject);
    const auto bytes = static_cast<double>(options.memoryBytes);
    quadsShare = std::min(1.0, kQuadsShare * bytes / std::max(1.0, kQuadBytes * sizes.quads));
    const double left = bytes - kQuadBytes * quadsShare * sizes.quads;
    texelsShare = std::min(1.0, left / std::max(1.0, kTexelBytes * sizes.texels));
  }
  for (ImageSize& size : sizes.ofObject) {
    size.quads *= quadsShare;
    size.texels *= texelsShare;
  }
  add(sizes.ofObject);
  sizes.bytes = imageBytes(sizes.quads, sizes.texels);
  if (quadsShare < 1.0 || texelsShare < 1.0) sizes.reduced = static_cast<std::uint64_t>(objects);
  return sizes;
}

}  // namespace catoptric::methods::glossy_lod
