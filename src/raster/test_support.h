// Shared by the tests of this module: uploads a scene to OpenGL, and reads its G-buffer back.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "frame/test_scenes.h"
#include "gl/test_context.h"
#include "raster/scene_raster.h"
#include "scene/animate.h"

namespace catoptric::test {

/// A scene uploaded at one moment in time; owns the scene.
struct Uploaded {
  scene::Scene scene;
  frame::Geometry geometry;
  frame::Lighting lighting;
  std::unique_ptr<raster::SceneRaster> raster;

  explicit Uploaded(scene::Scene s, double seconds = 0.0) : scene(std::move(s)) {
    gl::testContext();
    const scene::Pose pose = scene::poseAt(scene, seconds);
    geometry = frame::makeGeometry(scene, pose);
    lighting = frame::makeLighting(scene, pose,
                                   std::make_shared<frame::EnvironmentLight>(scene.environment));
    raster = std::make_unique<raster::SceneRaster>(scene, geometry);
  }
};

/// A G-buffer read back.
struct Samples {
  int width = 0;
  int height = 0;
  std::vector<float> diffuse;
  std::vector<float> normal;
  std::vector<float> depth;
  std::vector<std::uint32_t> ids;
  std::vector<std::uint8_t> stencil;
  raster::DrawStatistics statistics;

  std::size_t at(int x, int y) const { return static_cast<std::size_t>(y * width + x); }
  Vec3 radiance(std::size_t i) const {
    return {diffuse[4 * i], diffuse[4 * i + 1], diffuse[4 * i + 2]};
  }
  float s(std::size_t i) const { return diffuse[4 * i + 3]; }
  Vec3 n(std::size_t i) const { return {normal[4 * i], normal[4 * i + 1], normal[4 * i + 2]}; }
  float g(std::size_t i) const { return raster::lobeOf(normal[4 * i + 3]).roughness(); }
};

inline Samples readSamples(const raster::GBuffer& g) {
  Samples result;
  result.width = g.sampleWidth();
  result.height = g.sampleHeight();
  result.diffuse = raster::readRgba(g.diffuse);
  result.normal = raster::readRgba(g.normal);
  result.depth = raster::readDepth(g.depth);
  result.ids = raster::readIds(g.object);
  result.stencil = g.depth.read<std::uint8_t>(0, GL_STENCIL_INDEX, GL_UNSIGNED_BYTE, 1);
  return result;
}

inline Samples drawSamples(Uploaded& world, const scene::Camera& camera,
                           const raster::GBufferSize& size) {
  raster::GBuffer g = world.raster->makeGBuffer(size);
  const raster::DrawStatistics statistics = world.raster->drawGBuffer(g, camera, world.lighting);
  gl::checkErrors("drawGBuffer");
  Samples result = readSamples(g);
  result.statistics = statistics;
  return result;
}

/// A texture whose mip levels each have one colour, largest level first.
inline scene::Texture levelsTexture(const std::vector<glm::u8vec4>& colors, bool srgb) {
  scene::Texture texture;
  texture.srgb = srgb;
  for (std::size_t i = 0; i < colors.size(); ++i) {
    const int size = 1 << (colors.size() - 1 - i);
    scene::MipLevel level{size, size, {}};
    for (int k = 0; k < size * size; ++k) {
      for (int c = 0; c < 4; ++c) level.rgba.push_back(colors[i][c]);
    }
    texture.levels.push_back(std::move(level));
  }
  return texture;
}

inline scene::Camera cameraAt(const Vec3& eye, const Vec3& target, float fov = 0.8f) {
  return scene::lookAt(eye, target, {0.0f, 1.0f, 0.0f}, fov);
}

/// Turns a horizontal plane to face +z, with its tangent along +x.
inline Mat4 facingZ() {
  return rotation(90.0f, {1.0f, 0.0f, 0.0f});
}

}  // namespace catoptric::test
