// For the tests of environment_map: its frames of a scene, sample by sample.
#pragma once

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "frame/test_scenes.h"
#include "methods/environment_map/environment_map.h"
#include "methods/testing/gl_harness.h"

namespace catoptric::methods {

/// The method on a stage of its own, and its samples.
class Rig {
 public:
  Rig(scene::Scene scene, const std::string& options, bool masks = true)
      : stage(std::move(scene), test::framesOf(64, 48, 2, masks)),
        method_(stage, environmentMapEntry(), options) {}

  FrameOutput render(const scene::Camera& camera, std::vector<int> changed = {}) {
    camera_ = camera;
    return method_.render(camera, std::move(changed));
  }

  /// Samples of the last frame on the CPU.
  struct Sample {
    int object = 0;
    Vec3 ray{0};        // unit, from the eye
    Vec3 reflected{0};  // unit
    Vec3 place{0};      // world space
    Vec3 radiance{0};   // what the method wrote
    std::uint16_t mask = 0;
  };
  std::vector<Sample> samples() const {
    const raster::GBuffer& gbuffer = stage.gbuffer;
    const RunSettings& settings = stage.settings;
    const std::vector<float> normal = raster::readRgba(gbuffer.normal);
    const std::vector<float> reflection = raster::readRgba(gbuffer.reflection);
    const std::vector<std::uint32_t> ids = raster::readIds(gbuffer.object);
    const std::vector<float> depths = raster::readDepth(gbuffer.depth);
    const std::vector<std::uint16_t> masks =
        settings.masks ? raster::readMasks(gbuffer.masks) : std::vector<std::uint16_t>{};
    std::vector<Sample> all;
    for (int y = 0; y < gbuffer.sampleHeight(); ++y) {
      for (int x = 0; x < gbuffer.sampleWidth(); ++x) {
        const std::size_t i = all.size();
        Sample sample;
        sample.object = static_cast<int>(ids[i]);
        const auto perSample = 1.0f / static_cast<float>(settings.samples);
        sample.ray = scene::rayDirection(camera_, settings.width, settings.height,
                                         (static_cast<float>(x) + 0.5f) * perSample,
                                         (static_cast<float>(y) + 0.5f) * perSample);
        const Vec3 n(normal[4 * i], normal[4 * i + 1], normal[4 * i + 2]);
        sample.reflected = glm::reflect(sample.ray, n);
        const Vec3 axis = -Vec3(camera_.worldFromCamera[2]);
        sample.place = camera_.eye() + camera_.nearMetres / std::max(depths[i], 1e-30f) /
                                           glm::dot(axis, sample.ray) * sample.ray;
        sample.radiance = Vec3(reflection[4 * i], reflection[4 * i + 1], reflection[4 * i + 2]);
        if (!masks.empty()) sample.mask = masks[i];
        all.push_back(sample);
      }
    }
    return all;
  }

  int timesRun(const std::string& step) const {
    return static_cast<int>(std::ranges::count_if(
        stage.timer.samples(), [&](const frame::StepSample& s) { return s.step == step; }));
  }

  test::GlStage stage;

 private:
  test::GlMethod method_;
  scene::Camera camera_;
};

inline scene::Camera cameraAt(const Vec3& eye, const Vec3& target) {
  return scene::lookAt(eye, target, Vec3(0, 1, 0), radians(50.0f));
}

/// A new material of this radiance in all directions.
inline int unlit(test::SceneBuilder& builder, const Vec3& radiance) {
  scene::Material material;
  material.unlit = true;
  material.baseColor = radiance;
  builder.scene().materials.push_back(material);
  return static_cast<int>(builder.scene().materials.size()) - 1;
}

/// Radiance of a wall of addRoom(); faces as in scene::BoxShape.
inline Vec3 wallColor(int face) {
  return Vec3(static_cast<float>(face + 1), static_cast<float>((face * 5) % 7), 0.5f);
}

/// Adds six walls, `distance` metres from the origin.
inline void addRoom(test::SceneBuilder& builder, float distance) {
  for (int face = 0; face < 6; ++face) {
    scene::BoxShape wall;
    wall.size = Vec3(2 * distance);
    wall.inward = true;
    wall.faces = {};
    wall.faces[face] = true;
    builder.add(scene::makeBox(wall, scene::UvMode::Unit), unlit(builder, wallColor(face)));
  }
}

}  // namespace catoptric::methods
