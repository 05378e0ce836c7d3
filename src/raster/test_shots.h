// Draws small G-buffers and reads them back, for tests of surfaces and passes.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "raster/test_support.h"
#include "scene/texture.h"

namespace catoptric::test {

inline constexpr int kWidth = 64;
inline constexpr int kHeight = 48;
inline constexpr std::size_t kSamples = std::size_t{kWidth} * kHeight;

/// A G-buffer of kWidth x kHeight pixels, with the ray and position of each sample.
struct Shot : Samples {
  Shot(Uploaded& world, const scene::Camera& camera, int perAxis = 1)
      : Samples(drawSamples(world, camera, {kWidth, kHeight, perAxis, false})), eye(camera.eye()) {
    const float scale = 1.0f / static_cast<float>(perAxis);
    for (int i = 0; i < width * height; ++i) {
      direction.push_back(scene::rayDirection(camera, kWidth, kHeight,
                                              (static_cast<float>(i % width) + 0.5f) * scale,
                                              (static_cast<float>(i / width) + 0.5f) * scale));
      const Vec3& d = direction.back();
      const float z = camera.nearMetres / depth[static_cast<std::size_t>(i)];
      position.push_back(eye + d * (z / glm::dot(d, camera.forward())));
    }
  }

  Vec3 eye;
  std::vector<Vec3> direction, position;  ///< rebuilt from the depth; meaningless on the background
};

inline const Vec3 kUp(0.0f, 1.0f, 0.0f);
inline constexpr float kFov = 0.8f;

inline scene::Camera front(float distance = 5.0f) {
  return scene::lookAt({0.0f, 0.0f, distance}, Vec3(0.0f), kUp, kFov);
}

/// A camera above a plane at y = 0 that looks down obliquely.
inline scene::Camera above() {
  return scene::lookAt({0.3f, 1.5f, 2.0f}, Vec3(0.0f), kUp, kFov);
}

inline scene::Mesh plane(float size = 2.0f) {
  return scene::makePlane({size, size}, {1, 1}, scene::UvMode::Unit);
}

/// Adds a texture with the given texels as its base level.
inline int addTexture(SceneBuilder& builder, int width, int height, std::vector<std::uint8_t> rgba,
                      bool nearest = true, bool srgb = false) {
  scene::Texture t;
  t.name = "texels";
  t.srgb = srgb;
  t.nearest = nearest;
  t.levels = scene::makeMipChain(width, height, std::move(rgba), srgb);
  builder.scene().textures.push_back(t);
  return static_cast<int>(builder.scene().textures.size()) - 1;
}

}  // namespace catoptric::test
