// Compares the method's frames with Embree's rays from the same samples; makes the scenes of its
// tests.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "frame/test_scenes.h"
#include "methods/perturbation/perturbation.h"
#include "methods/testing/gl_harness.h"
#include "scene/implicit/surface.h"
#include "scene/shapes/shapes.h"

namespace catoptric::methods {

/// A scene, rendered by the method frame by frame and compared with Embree's rays.
class Comparison {
 public:
  Comparison(scene::Scene scene, const scene::Camera& camera, const std::string& options = "{}",
             const trace::ReflectionOptions& rays = {}, bool countDisocclusions = false,
             std::size_t maxPathTypes = perturbation::Options{}.maxPathTypes)
      : stage_(std::move(scene), settingsFor(rays, countDisocclusions)),
        method_(stage_, methodWith(options, maxPathTypes)),
        camera_(camera),
        rays_(rays) {
    render({});
  }

  /// Renders the next frame, at another time. `inParts`: draws only the samples that may have
  /// changed.
  void moveTo(double seconds, bool inParts = false) {
    const frame::Geometry before = stage_.moment.geometry;
    const std::vector<int> changed = stage_.moveTo(seconds);
    std::optional<raster::Region> part;
    if (inParts) {
      const int width = stage_.gbuffer.sampleWidth();
      const int height = stage_.gbuffer.sampleHeight();
      part.emplace(width, height);
      for (const int object : changed) {
        const auto i = static_cast<std::size_t>(object);
        for (const Box3& box : {before.objects[i].bounds, stage_.moment.geometry.objects[i].bounds})
          part->add(raster::shownRectangle(camera_, width, height, box));
      }
    }
    render(changed, part);
  }

  /// Renders the next frame, at the same time.
  void lookFrom(const scene::Camera& camera) {
    camera_ = camera;
    render({});
  }
  /// Renders the next frame, from another place and at another time.
  void lookFrom(const scene::Camera& camera, double seconds) {
    camera_ = camera;
    render(stage_.moveTo(seconds));
  }

  FrameOutput output;
  std::vector<Vec3> reflection;  ///< the method's radiance at reflective samples
  std::vector<std::uint16_t> masks;
  std::size_t samples = 0;
  double l1Of8Bit = 0.0;  ///< over reflective samples, of gamma 2.2 values
  bool finite = true;

 private:
  static RunSettings settingsFor(const trace::ReflectionOptions& rays, bool countDisocclusions) {
    RunSettings settings = test::framesOf(128, 128, 2, true);
    settings.fresnelSchlick = rays.fresnelSchlick;
    settings.countDisocclusions = countDisocclusions;
    return settings;
  }
  static std::unique_ptr<Method> methodWith(const std::string& options, std::size_t maxPathTypes) {
    perturbation::Options parsed =
        perturbation::optionTable().parse(config::parseText(options, "test options"));
    parsed.maxPathTypes = maxPathTypes;
    return perturbation::makeMethod(parsed);
  }

  void render(const std::vector<int>& changed,
              const std::optional<raster::Region>& part = std::nullopt) {
    output = method_.render(camera_, changed, part);
    masks = raster::readMasks(stage_.gbuffer.masks);
    test::TracedSamples found(stage_, camera_, rays_);
    samples = found.points.size();
    l1Of8Bit = found.l1Of8Bit();
    finite = finite && found.finite();
    reflection = std::move(found.ours);
  }

  test::GlStage stage_;
  test::GlMethod method_;
  scene::Camera camera_;
  trace::ReflectionOptions rays_;
};

inline scene::Camera cameraAt(const Vec3& eye, const Vec3& target) {
  return scene::lookAt(eye, target, Vec3(0.0f, 1.0f, 0.0f), radians(45.0f));
}

/// A mirror (the first object) before a coloured box on a floor.
inline test::SceneBuilder stage(scene::Mesh mirror, const Mat4& worldFromMirror,
                                float roughness = 0.0f) {
  test::SceneBuilder builder;
  builder.add(std::move(mirror), builder.reflective(1.0f, roughness), worldFromMirror);
  const auto box = [&](const Vec3& centre, const Vec3& size, const Vec3& color) {
    builder.add(scene::makeBox({.size = size}, scene::UvMode::Metres), builder.diffuse(color),
                test::translation(centre));
  };
  box({0.0f, -0.55f, 0.0f}, {6.0f, 0.1f, 6.0f}, {0.6f, 0.5f, 0.3f});
  box({1.3f, 0.2f, 0.8f}, {0.5f, 1.0f, 0.5f}, {0.9f, 0.1f, 0.2f});
  builder.constantEnvironment(Vec3(0.8f, 0.9f, 1.0f));
  return builder;
}

inline scene::Mesh sphereMesh(double radius, int cells = 48) {
  return scene::makeImplicit(implicit::sphereSurface(radius), cells, scene::UvMode::Metres);
}

inline const scene::Camera kFront = cameraAt({0.2f, 0.7f, 3.2f}, {0.2f, 0.0f, 0.0f});

/// stage() with a spherical mirror, and another mirror (the last object) beside it.
inline test::SceneBuilder twoMirrors(scene::Mesh other, const Mat4& worldFromOther) {
  test::SceneBuilder builder = stage(sphereMesh(0.55, 12), test::translation({-0.5f, 0.1f, 0.0f}));
  const int gold = builder.reflective(0.8f, 0.0f, {0.5f, 0.1f, 0.1f}, {1.0f, 0.8f, 0.5f});
  builder.add(std::move(other), gold, worldFromOther);
  return builder;
}
inline Mat4 uprightAt(const Vec3& place) {
  return test::translation(place) * test::rotation(90.0f, {1.0f, 0.0f, 0.0f});
}

}  // namespace catoptric::methods
