// A plane in surroundings of known radiance, and what every method shows of it.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "frame/test_scenes.h"
#include "methods/testing/gl_harness.h"
#include "scene/finish.h"

namespace catoptric::furnace {

using test::SceneBuilder;

inline constexpr int kSize = 64;
inline const methods::RunSettings kSettings = test::framesOf(kSize, kSize, 1, true);

/// A plane of 2 m that faces +z, seen straight on: it fills the frame, with uv from (0, 0) in the
/// upper left corner.
inline SceneBuilder furnacePlane(const scene::Material& material, scene::Mesh mesh) {
  SceneBuilder builder;
  builder.constantEnvironment(Vec3(1.0f));
  builder.scene().materials.push_back(material);
  builder.add(std::move(mesh), 0, test::rotation(90.0f, {1.0f, 0.0f, 0.0f}));
  return builder;
}
inline scene::Mesh plane() {
  return scene::makePlane({2.0f, 2.0f}, {1, 1}, scene::UvMode::Unit);
}
inline scene::Camera straightOn() {
  return scene::lookAt({0.0f, 0.0f, 2.0f}, {}, {0.0f, 1.0f, 0.0f}, 2.0f * std::atan(0.45f));
}
/// Where pixel (x, y) of that camera shows the plane, -1..1.
inline Vec2 onPlane(int x, int y) {
  return {0.9f * ((static_cast<float>(x) + 0.5f) * 2.0f / kSize - 1.0f),
          -0.9f * ((static_cast<float>(y) + 0.5f) * 2.0f / kSize - 1.0f)};
}

struct Frame {
  std::vector<float> pixels;  ///< R G B A
  std::vector<std::uint16_t> masks;
  methods::Counters counters;
  Vec3 at(int x, int y) const {
    const float* p =
        &pixels[4 * (static_cast<std::size_t>(y) * kSize + static_cast<std::size_t>(x))];
    return {p[0], p[1], p[2]};
  }
};

/// `options` besides those for small frames.
inline std::string optionsOf(const methods::MethodEntry& entry, const std::string& more) {
  // What renders whole images samples where the rasterizer does
  std::string options = entry.id == "reference"
                            ? R"({"max_standard_error": 0, "samples": 1, "rays": 4})"
                            : entry.tests.small;
  const std::string added =
      more.empty() && entry.id == "reference" ? std::string("\"bounces\": 1") : more;
  if (added.empty()) return options;
  options.insert(options.rfind('}'), (options.find(':') == std::string::npos ? "" : ", ") + added);
  return options;
}

/// The frame of a scene by every method that takes it, bounces where it knows any.
inline void byEveryMethod(
    const scene::Scene& scene, const scene::Camera& camera, int bounces,
    const std::function<void(const methods::MethodEntry&, const Frame&)>& check) {
  for (const methods::MethodEntry& entry : methods::registry()) {
    auto method = entry.make(config::parseText(entry.tests.small, "options"));
    if (!method->unsupported(scene).empty()) continue;  // others fill its reflectors
    const methods::MethodPlan plan = method->plan(scene, kSettings);
    if (bounces > 1 && plan.bounces == 0) continue;
    const std::string options =
        optionsOf(entry, bounces > 1 ? "\"bounces\": " + std::to_string(bounces) : "");
    SCOPED_TRACE(entry.id);
    Frame frame;
    if (!plan.gbuffer) {
      methods::FrameOutput output =
          test::renderOnCpu(entry, options, test::Moment(scene), camera, kSettings);
      const image::Image& image = output.image.value();
      for (int y = 0; y < kSize; ++y) {
        for (int x = 0; x < kSize; ++x) {
          for (int c = 0; c < 4; ++c) frame.pixels.push_back(image.at(x, y, c));
        }
      }
      frame.counters = output.counters;
    } else {
      test::GlStage stage(scene, kSettings);
      frame.counters = test::GlMethod(stage, entry, options).render(camera).counters;
      frame.pixels = stage.composite(camera);
      frame.masks = raster::readMasks(stage.gbuffer.masks);
    }
    check(entry, frame);
  }
}

/// Every pixel of the plane against `expected(place)`; pixels whose place is within `border` of an
/// edge of texels, `texels` a side, are left out.
inline void expectOnPlane(const scene::Scene& scene, int texels, float tolerance,
                          const std::function<Vec3(const Vec2&)>& expected, int bounces = 1) {
  int methods = 0;
  byEveryMethod(scene, straightOn(), bounces, [&](const methods::MethodEntry&, const Frame& frame) {
    ++methods;
    int compared = 0;
    float worst = 0.0f;
    for (int y = 0; y < kSize; ++y) {
      for (int x = 0; x < kSize; ++x) {
        const Vec2 place = onPlane(x, y);
        const Vec2 cell = (0.5f * place + 0.5f) * static_cast<float>(texels);
        const Vec2 away = glm::abs(cell - glm::round(cell));
        if (texels > 0 && std::min(away.x, away.y) < 0.08f) continue;
        ++compared;
        const Vec3 difference = glm::abs(frame.at(x, y) - expected(place));
        worst = std::max({worst, difference.x, difference.y, difference.z});
      }
    }
    EXPECT_GT(compared, kSize * kSize / 2);
    EXPECT_LE(worst, tolerance);
  });
  EXPECT_GE(methods, bounces > 1 ? 2 : 4);
}

inline scene::Material metal() {
  scene::Material m;
  m.metallicFactor = 1.0f;
  m.roughnessFactor = 0.0f;
  scene::setMetallicTint(m);
  return m;
}

}  // namespace catoptric::furnace
